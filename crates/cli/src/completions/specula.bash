# Completions of specula for bash: source this file, or write it to
# ~/.local/share/bash-completion/completions/specula.

_specula() {
    # Bash splits words at "=": they are joined again, and what precedes the last "=" stays as it was typed.
    local -a words=()
    local word help path joins= current=${COMP_WORDS[COMP_CWORD]} quoted= typed
    for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
        if [[ ( $joins || $word == "=" ) && ${#words[@]} -gt 0 ]]; then
            words[${#words[@]}-1]+=$word
        else
            words+=("$word")
        fi
        [[ $word == "=" ]] && joins=1 || joins=
    done
    [[ $current == "=" ]] && current=
    local last=$(( ${#words[@]} - 1 ))
    if [[ ${words[last]} == [\"\']* ]]; then
        quoted=1
        words[last]=${words[last]:1}
    else
        words[last]=${words[last]//\\/}
    fi
    typed=${words[last]%"${words[last]##*=}"}
    COMPREPLY=()
    while IFS=$'\t' read -r word help; do
        case $word in
            :files | :folders)
                compopt -o filenames 2>/dev/null
                while IFS= read -r path; do
                    COMPREPLY+=("$path")
                done < <([[ $word == :files ]] && compgen -f -- "$current" || compgen -d -- "$current")
                ;;
            *)
                word=${word#"$typed"}
                [[ $quoted ]] || printf -v word %q "$word"
                COMPREPLY+=("$word")
                ;;
        esac
    done < <("${1/#\~/$HOME}" complete -- "${words[@]}" 2>/dev/null)
}

complete -F _specula specula

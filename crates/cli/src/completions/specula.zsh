#compdef specula
# Completions of specula for zsh: write this file to a folder of $fpath as _specula, or source it after
# compinit.

_specula() {
    local -a found
    local line files folders
    for line in "${(@f)$(${(Q)words[1]} complete -- "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}"; do
        case $line in
            :files) files=1 ;;
            :folders) folders=1 ;;
            ?*) found+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}") ;;
        esac
    done
    local ret=1
    (( $#found )) && _describe 'specula' found && ret=0
    if [[ -n $files$folders ]]; then
        [[ $PREFIX == --*=* ]] && compset -P '*='
        if [[ -n $files ]]; then _files && ret=0; else _files -/ && ret=0; fi
    fi
    return ret
}

if [[ $funcstack[1] == _specula ]]; then
    _specula "$@"
else
    compdef _specula specula
fi

# Completions of specula for fish: source this file, or write it to
# ~/.config/fish/completions/specula.fish.

function __specula_complete
    set -l words (commandline -opc)
    # Without the quotes and backslashes that fish would remove.
    set -l current (commandline -ct | string trim --left --chars="\"'" | string unescape)
    # Of `--still=pictures/a` the path is what follows the equals sign.
    set -l option (string match -r '^--[^=]+=' -- "$current")
    set -l path (string replace -r '^--[^=]+=' '' -- "$current")
    for line in ($words[1] complete -- $words[2..] "$current" 2>/dev/null)
        switch $line
            case ':files'
                for name in (__fish_complete_path "$path")
                    echo "$option$name"
                end
            case ':folders'
                for name in (__fish_complete_directories "$path" '')
                    echo "$option$name"
                end
            case '*'
                echo $line
        end
    end
end

complete -c specula -f -a '(__specula_complete)'

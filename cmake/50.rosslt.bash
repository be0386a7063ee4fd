# Tab completion of the command rosslt, which computes the completions itself.

_rosslt() {
    local IFS=$'\n'
    # without the characters at which only bash ends words
    local line=${COMP_LINE:0:COMP_POINT}
    mapfile -t COMPREPLY < <(rosslt complete "$line" "${COMP_WORDS[COMP_CWORD]}" 2>/dev/null)
}
complete -o nospace -o default -F _rosslt rosslt

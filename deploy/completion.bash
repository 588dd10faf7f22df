# Bash completion of Osteon's programs. Each program's own --help says what there is:  . deploy/completion.bash

# The commands and options that a help text lists.
_osteon_commands() {
  sed -n -e '/^Subcommands:/,$ s/^  \([a-z][a-z-]*\) .*/\1/p' \
    -e 's/,//g; s/.*Other commands: \([a-z ]*\) (.*/\1/p' <<<"$1"
}
_osteon_options() { grep -oE -- '(^|[ ,])--[a-z][a-z-]+' <<<"$1" | tr -d ' ,'; }

_osteon() {
  local program=$1 word=$2 path=() help i
  help=$("$program" --help 2>/dev/null) || return
  for ((i = 1; i < COMP_CWORD; ++i)); do
    [[ " $(_osteon_commands "$help" | tr '\n' ' ') " == *" ${COMP_WORDS[i]} "* ]] || continue
    path+=("${COMP_WORDS[i]}")
    help=$("$program" "${path[@]}" --help 2>/dev/null) || return
  done
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(_osteon_options "$help")" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -W "$(_osteon_commands "$help")" -- "$word")
    compopt -o default 2>/dev/null || true  # files, where no command fits
  fi
}
complete -F _osteon osteon osteon-import osteon-server osteon-haptic osteon-viewer osteon-audio

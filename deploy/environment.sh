# Sourced by the scripts of this folder. It gives them the same environment, whoever calls them and from wherever.
# Sets $root, the checkout, and defines `die`, which ends the script with one sentence, and what builds need.
unset CDPATH
root=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/.." && pwd -P)
export PATH="${PATH:-/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin}"
export HOME="${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}"
export LC_ALL=C.UTF-8 PYTHONDONTWRITEBYTECODE=1

# Debian's own Python has the packages of deploy/packages.txt. Another python3 in PATH may not have them.
python=/usr/bin/python3

die() { printf 'deploy/%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }

# One compiler takes up to 2 GB. So use as many jobs as there are processors, but no more than fit into memory.
compiler_jobs() {
  [ -z "${OSTEON_JOBS:-}" ] || { echo "$OSTEON_JOBS"; return; }
  awk -v cpus="$(nproc)" \
    '/MemAvailable/ { fit = int($2 / 2e6); print fit < 1 ? 1 : fit < cpus ? fit : cpus }' /proc/meminfo
}

# show_build_progress WHAT LOG: writes to LOG what ninja prints, and shows how far it is. A terminal gets one line that
# is rewritten. Other outputs get a line at every tenth.
show_build_progress() {
  local what=$1 log=$2 line step total tenth shown=-1 started=$SECONDS
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$log"
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    step=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    if [ -t 1 ]; then printf '\r\033[KBuilding %s: %d of %d, %d s' "$what" "$step" "$total" $((SECONDS - started))
    elif [ "$total" -gt 10 ]; then
      tenth=$((step * 10 / total))
      [ "$tenth" = "$shown" ] ||
        printf 'Building %s: %d of %d, %d s\n' "$what" "$step" "$total" $((SECONDS - started))
      shown=$tenth
    fi
  done
  ! [ -t 1 ] || printf '\r\033[K'
}

# Sourced by the scripts of this folder. It gives them the same environment, whoever calls them and from wherever.
# Sets $root, the checkout, and defines `die`, which ends the script with one sentence.
unset CDPATH
root=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/.." && pwd -P)
export PATH="${PATH:-/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin}"
export HOME="${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}"
export LC_ALL=C.UTF-8 PYTHONDONTWRITEBYTECODE=1

# Debian's own Python has the packages of deploy/packages.txt. Another python3 in PATH may not have them.
python=/usr/bin/python3

die() { printf 'deploy/%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }

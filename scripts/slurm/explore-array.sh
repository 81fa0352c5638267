#!/usr/bin/env bash
# Runs a design space as a Slurm job array: N shards, then a job that merges them.
#
#   explore-array.sh SPACE -o DIR -n SHARDS [--tries K] [-- SBATCH-OPTION...]
#
# SPACE      the space file
# -o DIR     results: DIR/shard-1 ... DIR/shard-N, logs in DIR/logs, the merged results in DIR
# -n SHARDS  elements of the array. Make them few and long: 10 elements of 100 points, not one element a point
# --tries K  how often an element that was killed or lost is started at most (default 3)
# after --   options for sbatch: --partition, --time, --cpus-per-task, --mem, --account, ...
#
# Also the way to go on after a failure: the same command again runs what is not done and merges.
# RADENG names the program (default: radeng on PATH). Prints the number of the merge job: `squeue -j` shows it.
set -euo pipefail

usage() { sed -n '2,14s/^# \{0,1\}//p' "$0" >&2; exit 2; }
die() { echo "explore-array: $*" >&2; exit 2; }

space='' out='' shards='' tries=3
while [ $# -gt 0 ]; do
    case $1 in
    -o) out=${2:?-o without a folder}; shift 2 ;;
    -n) shards=${2:?-n without a number}; shift 2 ;;
    --tries) tries=${2:?--tries without a number}; shift 2 ;;
    --) shift; break ;;
    -h | --help) usage ;;
    -*) die "unknown option $1" ;;
    *) [ -z "$space" ] || die "two spaces: $space and $1"; space=$1; shift ;;
    esac
done
[ -n "$space" ] && [ -n "$out" ] && [ -n "$shards" ] || usage
[[ $shards =~ ^[1-9][0-9]{0,4}$ ]] || die "-n $shards: expected a whole number from 1 to 99999"
[[ $tries =~ ^[1-9][0-9]?$ ]] || die "--tries $tries: expected a whole number from 1 to 99"
[ -f "$space" ] || die "$space: no such file"
command -v sbatch >/dev/null || die "sbatch is not on PATH: this machine submits to no Slurm"
radeng=$(command -v "${RADENG:-radeng}") || die "${RADENG:-radeng}: no such program (RADENG names another)"
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out/logs"
out=$(cd "$out" && pwd)
# Nodes see the same folders, maybe not the same current one.
space=$(cd "$(dirname "$space")" && pwd)/$(basename "$space")
radeng=$(cd "$(dirname "$radeng")" && pwd)/$(basename "$radeng")

exec "$here/submit.sh" "$here" "$radeng" "$space" "$out" "$shards" "$tries" 1 "$@"

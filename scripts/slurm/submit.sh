#!/usr/bin/env bash
# Submits the shards that are not done, and a job after them that merges, or submits again what was lost.
#
#   submit.sh SCRIPTS RADENG SPACE DIR SHARDS TRIES TRY [SBATCH-OPTION...]     (from explore-array.sh and merge.sbatch)
set -euo pipefail
here=$1 radeng=$2 space=$3 out=$4 shards=$5 tries=$6 try=$7
shift 7

# The elements that are not done, as sbatch takes them: 1-4,7.
todo='' first=0
for i in $(seq $((shards + 1))); do
    if [ "$i" -le "$shards" ] && [ ! -e "$out/shard-$i.done" ]; then
        [ "$first" -ne 0 ] || first=$i
        continue
    fi
    if [ "$first" -ne 0 ]; then
        last=$((i - 1))
        if [ "$first" -eq "$last" ]; then todo+=",$first"; else todo+=",$first-$last"; fi
        first=0
    fi
done
todo=${todo#,}

after=()
if [ -n "$todo" ]; then
    array=$(sbatch --parsable --job-name=radeng-shard --array="$todo" --requeue --open-mode=append \
        --output="$out/logs/shard-%a.log" "$@" \
        "$here/shard.sbatch" "$radeng" "$space" "$out" "$shards" "$tries")
    after=(--dependency="afterany:${array%%;*}")
    echo "shards $todo of $shards: job ${array%%;*}" >&2
fi
# afterany: also when elements failed, since then this job submits them again.
merge=$(sbatch --parsable --job-name=radeng-merge --requeue --open-mode=append --output="$out/logs/merge.log" \
    "${after[@]}" "$@" \
    "$here/merge.sbatch" "$here" "$radeng" "$space" "$out" "$shards" "$tries" "$try" "$@")
echo "${merge%%;*}"

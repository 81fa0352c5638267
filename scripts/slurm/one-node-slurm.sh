#!/usr/bin/env bash
# A real Slurm (munged, slurmctld, slurmd) with one node on the loopback interface, for tests and for trying out.
#
#   one-node-slurm.sh start [DIR]     starts it; everything it writes is in DIR (default /tmp/radeng-slurm-UID)
#   . DIR/environment                 then sbatch, squeue and the others talk to it
#   one-node-slurm.sh stop [DIR]      stops it, by its own pid files; DIR stays
#
# Needs slurmctld, slurmd and munged (Debian: slurm-wlm, munge). It runs as whoever starts it, and touches neither
# /etc/slurm nor a munge that runs already. CPUS and MEM_MB say how large the node is to be.
set -euo pipefail

usage() { sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
die() { echo "one-node-slurm: $*" >&2; exit 1; }

what=${1:-}
dir=${2:-/tmp/radeng-slurm-$(id -u)}
PATH=$PATH:/usr/sbin:/sbin

# Kills the process of a pid file, and waits until it is gone.
stop_one() {
    local file=$1 pid
    [ -s "$file" ] || return 0
    pid=$(cat "$file")
    kill "$pid" 2>/dev/null || { rm -f "$file"; return 0; }
    for _ in $(seq 100); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    kill -0 "$pid" 2>/dev/null && kill -9 "$pid"
    rm -f "$file"
}

start() {
    local missing=() tool
    for tool in slurmctld slurmd munged munge sbatch; do command -v "$tool" >/dev/null || missing+=("$tool"); done
    [ ${#missing[@]} -eq 0 ] || die "not installed: ${missing[*]} (Debian: apt-get install slurm-wlm munge)"
    mkdir -p "$dir"
    dir=$(cd "$dir" && pwd)
    [ ! -s "$dir/slurmctld.pid" ] || ! kill -0 "$(cat "$dir/slurmctld.pid")" 2>/dev/null || die "$dir runs already"
    mkdir -p "$dir/state" "$dir/spool" "$dir/log" "$dir/munge"
    chmod 755 "$dir" "$dir/munge"
    local user host cpus mem port
    user=$(id -un) host=$(hostname -s)
    cpus=${CPUS:-$(nproc)} mem=${MEM_MB:-1000}
    # Two ports of its own, so that a cluster's daemons on this machine are left alone.
    port=$((20000 + $$ % 20000))
    if [ ! -s "$dir/munge/key" ]; then
        (umask 077 && head -c 1024 /dev/urandom >"$dir/munge/key")
    fi
    cat >"$dir/slurm.conf" <<CONF
ClusterName=one-node
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
# A job that is put back in the queue starts again after cred_expire seconds.
AuthInfo=socket=$dir/munge/socket,cred_expire=5
CredType=cred/munge
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/log/slurmctld.log
SlurmdLogFile=$dir/log/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,batch_sched_delay=0,requeue_setup_env_fail
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MaxArraySize=20001
MaxJobCount=50000
MinJobAge=300
ReturnToService=2
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cpus RealMemory=$mem State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
    cat >"$dir/environment" <<ENV
export SLURM_CONF='$dir/slurm.conf'
ENV
    export SLURM_CONF=$dir/slurm.conf
    # --force: the key need not be root's, nor the folder.
    munged --force --socket="$dir/munge/socket" --key-file="$dir/munge/key" --pid-file="$dir/munged.pid" \
        --log-file="$dir/log/munged.log" --seed-file="$dir/munge/seed" 2>>"$dir/log/munged.start" ||
        die "munged did not start: $dir/log"
    slurmctld -f "$dir/slurm.conf" || { stop; die "slurmctld did not start: $dir/log"; }
    slurmd -f "$dir/slurm.conf" || { stop; die "slurmd did not start: $dir/log"; }
    for _ in $(seq 60); do
        if sinfo -h -o %t 2>/dev/null | grep -qE 'idle|mix|alloc'; then
            echo "Slurm is up: . $dir/environment"
            return 0
        fi
        sleep 0.5
    done
    stop
    die "Slurm did not come up: $dir/log"
}

stop() {
    stop_one "$dir/slurmd.pid"
    stop_one "$dir/slurmctld.pid"
    stop_one "$dir/munged.pid"
}

case $what in
start) start ;;
stop) stop ;;
*) usage ;;
esac

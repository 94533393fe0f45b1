#!/bin/sh
# A Slurm of one machine, for trying out campaigns on a batch system (docs/cluster.md). As root, on
# Debian, without systemd:
#   tools/slurm_one_machine.sh install    the packages, from Debian
#   tools/slurm_one_machine.sh start      its daemons, with their state in STATE; prints sinfo
#   tools/slurm_one_machine.sh stop       ends its jobs, and what start has started
# STATE is the environment's SLURM_STATE, or /var/tmp/desim-slurm. Its slurm.conf is in there:
# the commands find it by SLURM_CONF. One partition, main, with 8 CPUs, whatever the machine has.
# SLURMCTLD_PORT and SLURMD_PORT, where Slurm's own two ports are taken.
set -eu

STATE=${SLURM_STATE:-/var/tmp/desim-slurm}
export SLURM_CONF="$STATE/slurm.conf"

configure() {
    host=$(hostname -s)
    mkdir -p "$STATE/state" "$STATE/d" "$STATE/log"
    cat > "$SLURM_CONF" <<CONF
ClusterName=desim
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${SLURMCTLD_PORT:-6817}
SlurmdPort=${SLURMD_PORT:-6818}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
SlurmdParameters=config_overrides
InactiveLimit=0
KillWait=2
StateSaveLocation=$STATE/state
SlurmdSpoolDir=$STATE/d
SlurmctldPidFile=$STATE/ctld.pid
SlurmdPidFile=$STATE/d.pid
SlurmctldLogFile=$STATE/log/ctld.log
SlurmdLogFile=$STATE/log/d.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SchedulerParameters=sched_interval=2,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=8 Boards=1 SocketsPerBoard=1 CoresPerSocket=8 \\
ThreadsPerCore=1 RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
CONF
}

start_munge() {
    munge -n > /dev/null 2>&1 && return
    mkdir -p /run/munge
    chown munge /run/munge
    runuser -u munge -- munged
    touch "$STATE/munged"
}

await() { # COMMAND...: until it succeeds, ten seconds at most
    for _ in 1 2 3 4 5 6 7 8 9 10; do
        "$@" && return
        sleep 1
    done
    return 1
}

node_is_idle() { # as soon as its slurmd has told slurmctld about itself
    timeout 5 sinfo -h -o %T | grep -q '^idle$'
}

nobody_has_a_job() {
    jobs=$(timeout 5 squeue -h) && [ -z "$jobs" ]
}

end() { # PIDFILE: whose daemon takes the file away before it has ended
    [ -f "$1" ] || return 0
    pid=$(cat "$1")
    kill "$pid" 2> /dev/null || return 0
    await has_ended "$pid" || kill -9 "$pid"
}

has_ended() { # a zombie has
    ! grep -q '^State:[[:space:]]*[^Z]' "/proc/$1/status" 2> /dev/null
}

case ${1:-} in
install)
    apt-get update
    DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        slurm-wlm slurm-wlm-torque munge
    ;;
start)
    configure
    start_munge
    slurmctld -c
    sleep 1
    slurmd
    await node_is_idle || { tail -n 5 "$STATE"/log/*; exit 1; }
    timeout 5 sinfo
    ;;
stop)
    # Jobs first: without slurmctld they wait for it for ever, and so does slurmd.
    if [ -f "$STATE/ctld.pid" ] && timeout 5 scancel --partition=main; then
        await nobody_has_a_job || true
    fi
    end "$STATE/d.pid"
    end "$STATE/ctld.pid"
    if [ -f "$STATE/munged" ]; then
        end /run/munge/munged.pid
        rm "$STATE/munged"
    fi
    ;;
*)
    sed -n '2,9s/^# \{0,1\}//p' "$0"
    exit 2
    ;;
esac

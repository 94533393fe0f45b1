#!/bin/sh
# A Slurm of one machine, for trying out campaigns on a batch system (docs/cluster.md). As root, on
# Debian, without systemd:
#   tools/slurm_one_machine.sh install    the packages, from Debian
#   tools/slurm_one_machine.sh start      its daemons, with their state in STATE; prints sinfo
#   tools/slurm_one_machine.sh stop       ends what start has started
# STATE is the environment's SLURM_STATE, or /var/tmp/desim-slurm. Its slurm.conf is in there:
# the commands find it by SLURM_CONF. One partition, main, with 8 CPUs, whatever the machine has.
set -eu

STATE=${SLURM_STATE:-/var/tmp/desim-slurm}
export SLURM_CONF="$STATE/slurm.conf"

configure() {
    host=$(hostname -s)
    mkdir -p "$STATE/state" "$STATE/d" "$STATE/log"
    cat > "$SLURM_CONF" <<CONF
ClusterName=desim
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
SlurmdParameters=config_overrides
InactiveLimit=0
KillWait=5
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
    # A node is idle as soon as its slurmd has told slurmctld about itself.
    for _ in 1 2 3 4 5 6 7 8 9 10; do
        timeout 5 sinfo -h -o %T | grep -q '^idle$' && break
        sleep 1
    done
    timeout 5 sinfo
    timeout 5 sinfo -h -o %T | grep -q '^idle$'
    ;;
stop)
    for daemon in d ctld; do
        pid=$STATE/$daemon.pid
        if [ -f "$pid" ]; then
            kill "$(cat "$pid")" || true
        fi
    done
    ;;
*)
    sed -n '2,8s/^# \{0,1\}//p' "$0"
    exit 2
    ;;
esac

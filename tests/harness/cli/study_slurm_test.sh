#!/usr/bin/env bash
# A study on a Slurm cluster of two nodes, both on this machine and only for this test: four tasks, one of them killed
# and requeued, merged, must equal the study made by one process. Usage: study_slurm_test.sh DEXCHECK
set -euo pipefail

skip=77
dexcheck=$(realpath "$1")
[[ $(id -u) -eq 0 ]] || { echo "skipped: slurmd needs root"; exit $skip; }
for program in munged slurmctld slurmd sbatch squeue scontrol sqlite3; do
  command -v $program >/dev/null || { echo "skipped: no $program here"; exit $skip; }
done
mountpoint --quiet /sys/fs/cgroup || { echo "skipped: slurmd needs control groups in /sys/fs/cgroup"; exit $skip; }

folder=$(mktemp -d /tmp/dexcheck-slurm-XXXXXX)
daemons=()
Finish() {
  code=$?
  if [[ $code -ne 0 ]]; then tail -n 15 "$folder"/*.log >&2 || true; fi
  kill "${daemons[@]}" 2>/dev/null || true
  wait "${daemons[@]}" 2>/dev/null || true
  rm -rf "$folder"
}
trap Finish EXIT
cd "$folder"
chmod 755 .

cat >study.toml <<'END'
name = "tiny"
scenario = "offset"
set = ["duration=6", "settle=0.3"]
[[vary]]
key = "control.K_p"
values = [100, 1000, 1e4, 1e6]
[[vary]]
key = "control.K_v"
values = [20, 200, 2100]
END

# A cluster: its own munge key and socket, three ports by the process id, below those that the system gives out.
host=$(hostname -s)
Listens() { (: <>/dev/tcp/127.0.0.1/"$1") 2>/dev/null; }
port=$((10000 + 4 * ($$ % 5000)))
while Listens $port || Listens $((port + 1)) || Listens $((port + 2)); do port=$((port + 4)); done
export SLURM_CONF=$folder/slurm.conf
cat >slurm.conf <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
# A requeued task may begin when its old credential has expired, and not before: a node refuses it until then.
AuthInfo=socket=$folder/munge.socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool-%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd-%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SchedulerParameters=sched_interval=2,batch_sched_delay=0
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
SlurmdTimeout=300
NodeName=n[1-2] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=1 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
mkdir state spool-n1 spool-n2
dd if=/dev/urandom of=munge.key bs=64 count=1 status=none
chmod 400 munge.key
# In the foreground of this shell, so that they end with it.
munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
  --pid-file="$folder/munge.pid" --log-file="$folder/munge.log" --seed-file="$folder/munge.seed" >munged.log 2>&1 &
daemons+=($!)
slurmctld -D -f slurm.conf >slurmctld.log 2>&1 &
daemons+=($!)
for node in n1 n2; do
  slurmd -D -N $node -f slurm.conf >slurmd-$node.log 2>&1 &
  daemons+=($!)
done

# WaitFor SECONDS COMMAND...: until the command succeeds.
WaitFor() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    if ((SECONDS >= end)); then echo "waited in vain for: $*" >&2; return 1; fi
    sleep 0.1
  done
}
NodesAreIdle() { [[ $(sinfo --noheader --Node --format=%t 2>/dev/null | grep -c idle) -eq 2 ]]; }
WaitFor 60 NodesAreIdle

"$dexcheck" study slurm study.toml --tasks 4 >job.sh
job=$(sbatch --parsable job.sh)
# The first task has two trials that take their time and one that diverges at once: its first row comes halfway.
HasRow() { [[ $(sqlite3 "file:tiny-1-of-4.sqlite?mode=ro" 'SELECT count(*) FROM trials' 2>/dev/null) -ge 1 ]]; }
WaitFor 60 HasRow
# A task that is just ending is refused ("in transitional state"): asked again, it has ended, and is done once more.
Requeue() { scontrol requeue "${job}_1"; }
WaitFor 30 Requeue
# A controller that does not answer is not an empty queue.
IsDone() {
  local left
  left=$(squeue --noheader --jobs="$job" 2>/dev/null) && [[ -z $left ]]
}
Requeued() { scontrol show job "${job}_1" | grep 'Restarts=1' >/dev/null; }
WaitFor 30 Requeued
WaitFor 180 IsDone
nodes=$(scontrol show job "$job" | grep -oE ' NodeList=n[12]' | sort -u | wc -l)
[[ $nodes -eq 2 ]] || { scontrol show job "$job" >&2; echo "tasks ran on $nodes nodes, not 2" >&2; exit 1; }
EachCompleted() {
  scontrol show job "$job" >states.txt
  if grep -E '^ *JobState=' states.txt | grep -v COMPLETED; then
    cat states.txt ./*-of-*.log >&2
    return 1
  fi
}
EachCompleted

"$dexcheck" study merge --quiet merged.sqlite tiny-*-of-4.sqlite
"$dexcheck" study run study.toml --db single.sqlite --quiet
Dump() { sqlite3 "$1" '.mode quote' 'SELECT * FROM study' 'SELECT * FROM trials ORDER BY trial'; }
[[ $(sqlite3 single.sqlite 'SELECT count(*) FROM trials') -eq 12 ]] || { echo "not 12 trials" >&2; exit 1; }
diff <(Dump merged.sqlite) <(Dump single.sqlite)
echo "four tasks on two nodes, one requeued: 12 trials equal to those of one process"

# A search is one task, which makes its trials side by side.
cat >search.toml <<'END'
name = "search"
scenario = "offset"
set = ["duration=0.05", "settle=0.3"]
[search]
method = "cma_es"
count = 24
population = 8
[[objective]]
minimize = "position_error_rms"
[[vary]]
key = "control.K_p"
from = 100
to = 1e4
spacing = "log"
[[vary]]
key = "control.K_v"
from = 20
to = 1500
spacing = "log"
END
"$dexcheck" study slurm search.toml --tasks 1 >search.sh
job=$(sbatch --parsable search.sh)
WaitFor 180 IsDone
EachCompleted
"$dexcheck" study run search.toml --db search.sqlite --quiet
[[ $(sqlite3 search.sqlite 'SELECT count(*) FROM trials') -eq 24 ]]
diff <(Dump search-1-of-1.sqlite) <(Dump search.sqlite)
echo "a task: the 24 trials of a search equal to those of one process"

#!/usr/bin/env bash
# Runs an emitted job array on a Slurm of this machine, requeues a task in the middle, and compares
# the outcomes with those of a plain batch. As root, on Debian; else one clear word and no more.
# usage: tests/cluster/slurm.sh ISOSPLINE FOLDER
set -euo pipefail
isospline=$(realpath "$1")
mkdir -p "$2"
cd "$2"
if [ "$(id -u)" -ne 0 ]; then echo "skipped: Slurm is started as root only"; exit 0; fi
for program in munged slurmctld slurmd sbatch; do
  PATH=$PATH:/usr/sbin command -v $program >/dev/null || { echo "skipped: no $program"; exit 0; }
done
PATH=$PATH:/usr/sbin

mkdir -p library run
printf '[model]\nformula = "x^2+y^2+z^2-1"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n' > library/ball.toml
printf '[model]\nformula = "x^2+y^2-z^2*(1-z^2)"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n' > library/cone.toml
printf '[model]\nformula = "(sqrt(x^2+y^2)-1)^2+z^2-0.1"\nbox = [[-1.5,1.5],[-1.5,1.5],[-0.5,0.5]]\n[target]\nfaces = 20000\n' > library/a_large.toml
set_all=(--set target.fit=paper)

host=$(hostname -s)
cat > run/slurm.conf <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobRequeue=1
MinJobAge=600
SlurmctldPidFile=$PWD/run/ctld.pid
SlurmdPidFile=$PWD/run/d.pid
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation=$PWD/run/state
SlurmdSpoolDir=$PWD/run/spool
SlurmctldLogFile=$PWD/run/ctld.log
SlurmdLogFile=$PWD/run/d.log
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES State=UP
CONF
mkdir -p run/state run/spool /run/munge
export SLURM_CONF=$PWD/run/slurm.conf
[ -s /etc/munge/munge.key ] || { dd if=/dev/urandom of=/etc/munge/munge.key bs=1024 count=1 2>/dev/null; chmod 400 /etc/munge/munge.key; }
chown -R munge: /etc/munge /run/munge /var/lib/munge /var/log/munge 2>/dev/null || true
runuser -u munge -- munged --force >/dev/null 2>&1 || true
slurmctld && slurmd
stop() { for f in run/d.pid run/ctld.pid; do [ -s $f ] && kill "$(cat $f)" 2>/dev/null; done; true; }
trap stop EXIT
for ((i = 0; i < 50; i++)); do sinfo -h -o %t 2>/dev/null | grep -q idle && break; sleep 0.2; done

"$isospline" batch library --out out "${set_all[@]}" --emit slurm
job=$(sbatch --parsable out/batch.slurm)
# The large model is the first. What it has begun when it is requeued is gone on with.
for ((i = 0; i < 300; i++)); do [ -e out/a_large/01-polygonize.isos ] && break; sleep 0.1; done
if scontrol requeue "${job}_0"; then echo "requeued in the middle"; else echo "the first task had ended before it could be requeued"; fi
for ((i = 0; i < 1800; i++)); do [ -z "$(squeue -h -j "$job" 2>/dev/null)" ] && break; sleep 0.5; done
echo "tasks: $(scontrol show job "$job" | grep -c JobState=COMPLETED) completed"

code=0
"$isospline" batch library --out out "${set_all[@]}" --json > collected.jsonl || code=$?
[ "$code" -eq 3 ] && [ ! -s collected.jsonl ] || { echo "FAILED: the array left models undone"; exit 1; }
"$isospline" batch library --out plain "${set_all[@]}" --json > /dev/null 2>&1 || true
outcomes() { sed 's/.*"model":"\([^"]*\)","outcome":"\([^"]*\)","reason":"\([^"]*\)".*/\1 \2 \3/' "$1/summary.jsonl" | sort; }
diff <(outcomes out) <(outcomes plain)
cmp out/a_large/11-fairing.isos plain/a_large/11-fairing.isos
echo "the array of Slurm did what the batch does"

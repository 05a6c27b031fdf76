# SPDX-License-Identifier: Apache-2.0
"""A Slurm of our own on the loopback interface: one controller, one node, one authentication daemon,
each with files and ports of its own. Nothing of the machine's own is read or touched, and all of it
is gone at the end."""
import os
import shutil
import socket
import subprocess
import time
from pathlib import Path

CONFIGURATION = """
ClusterName=truetriad
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
MailProg=/bin/true
KillWait=2
SchedulerParameters=sched_interval=2
SlurmdParameters=config_overrides
NodeName=node NodeHostname={host} NodeAddr=127.0.0.1 Port={node_port} CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes=node Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """What must be installed for it, or be otherwise; None: nothing."""
    for program in ("slurmctld", "slurmd", "munged"):
        if shutil.which(program, path=PATH) is None:
            return f"{program} is not installed"
    return None if os.geteuid() == 0 else "only root can start it"


PATH = os.environ.get("PATH", "") + os.pathsep + "/usr/sbin"
LONGEST_S = 600  # However busy the machine is.


def free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class PrivateSlurm:
    def __init__(self, folder, cpus=4):
        """`folder`: exists, is not writable by others, and has a short name (it holds a socket)."""
        self.folder = Path(folder)
        self.cpus = cpus
        self.daemons = []
        self.environment = dict(os.environ, PATH=PATH, SLURM_CONF=str(self.folder / "slurm.conf"))

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def start(self):
        for name in ("munge", "state", "spool"):
            (self.folder / name).mkdir(mode=0o755)
        controller_port, node_port = free_ports(2)
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(
            host=socket.gethostname().split(".")[0], controller_port=controller_port,
            node_port=node_port, folder=self.folder, cpus=self.cpus))
        key = self.folder / "munge/key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        munge = self.folder / "munge"
        self.daemon("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={munge}/socket",
                    f"--pid-file={munge}/pid", f"--log-file={munge}/log", f"--seed-file={munge}/seed")
        self.wait("munged", (munge / "socket").exists)
        self.daemon("slurmctld", "-D", "-i")
        self.daemon("slurmd", "-D", "-N", "node")
        self.wait("the node", lambda: self.call("sinfo", "-h", "-o", "%t", check=False).strip() == "idle")

    def daemon(self, *words):
        log = open(self.folder / f"{words[0]}.out", "wb")
        self.daemons.append(subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                             env=self.environment, start_new_session=True))
        log.close()

    def stop(self):
        """Jobs first, then the daemons, the last started first."""
        if len(self.daemons) == 3:
            self.call("scancel", "--user=root", check=False)
            try:
                self.wait("the jobs' end", lambda: not self.call("squeue", "-h", check=False).strip(), 10)
            except AssertionError:
                pass
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        self.daemons = []

    def wait(self, what, is_so, seconds=LONGEST_S):
        end = time.monotonic() + seconds
        while not is_so():
            dead = [daemon.args[0] for daemon in self.daemons if daemon.poll() is not None]
            if dead or time.monotonic() > end:
                logs = "\n".join(f"{path.name}: {path.read_text(errors='replace')[-2000:]}"
                                 for path in sorted(self.folder.glob("*.log")) + sorted(self.folder.glob("*.out")))
                raise AssertionError(f"waited for {what}; ended: {dead}\n{logs}")
            time.sleep(0.05)

    def call(self, *words, check=True):
        done = subprocess.run([str(w) for w in words], env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, encoding="utf-8")
        if check and done.returncode != 0:
            raise AssertionError(f"{words} ended with {done.returncode}: {done.stderr}")
        return done.stdout

    def state(self, job):
        """"PENDING", "RUNNING", "COMPLETED", …; of an array's task: "5_3"."""
        text = self.call("scontrol", "show", "job", job, "-o", check=False)
        return next((word.split("=")[1] for word in text.split() if word.startswith("JobState=")), "GONE")

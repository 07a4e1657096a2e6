import json, queue, subprocess, sys, threading

class Loop:
    """metaplan run as a child. A thread reads all that it says, so that neither ever waits for the other."""
    def __init__(self, *command):
        self.child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.answers = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.child.stdout:
            self.answers.put(json.loads(line))
        self.answers.put({"answer": "end"})

    def wait(self):
        """Yields the answers to a line, except `handled`. The first call yields `ready` and the first plan."""
        while (answer := self.answers.get())["answer"] not in ("handled", "end"):
            yield answer

    def tell(self, **event):
        self.child.stdin.write(json.dumps(event) + "\n")
        return list(self.wait())

loop = Loop(*sys.argv[1:])
todo = [answer for answer in loop.wait()]
while not any(answer["answer"] == "goal_reached" for answer in todo):
    action = [answer["action"] for answer in todo if answer["answer"] == "request_action"][-1]
    print("doing", action)  # drive the robot here
    todo = loop.tell(event="action_succeeded", action=action)
loop.child.stdin.close()
print("done", loop.child.wait())

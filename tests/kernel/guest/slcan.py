"""Two slcan adapters on one bus, each on a pty whose name it writes to /tmp/slcan.N. What one is told besides frames
goes to /tmp/slcan.told. A line in /tmp/slcan.say is sent by the first as it is."""
import os
import pty
import select
import tty

masters = []
for number in range(2):
    master, slave = pty.openpty()
    tty.setraw(master)
    tty.setraw(slave)
    masters.append(master)
    with open('/tmp/slcan.%d' % number, 'w') as name:
        name.write(os.ttyname(slave))
waiting = {master: b'' for master in masters}
while True:
    ready, _, _ = select.select(masters, [], [], 0.1)
    if os.path.exists('/tmp/slcan.say'):
        with open('/tmp/slcan.say', 'rb') as say:
            os.write(masters[0], say.read().strip() + b'\r')
        os.remove('/tmp/slcan.say')
    for master in ready:
        other = masters[1 - masters.index(master)]
        waiting[master] += os.read(master, 4096)
        *lines, waiting[master] = waiting[master].split(b'\r')
        for line in lines:
            if line[:1] in (b't', b'T', b'r', b'R'):
                os.write(other, line + b'\r')
            else:
                with open('/tmp/slcan.told', 'ab') as told:
                    told.write(line + b'\n')

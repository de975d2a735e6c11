"""An slcan adapter on a pty, whose name it writes to /tmp/slcan.tty. A frame comes back with its id raised by 0x100;
what else it was told goes to /tmp/slcan.told. A line in /tmp/slcan.say is sent as it is."""
import os
import pty
import select
import tty

master, slave = pty.openpty()
tty.setraw(master)
tty.setraw(slave)
with open('/tmp/slcan.tty', 'w') as name:
    name.write(os.ttyname(slave))
waiting = b''
while True:
    ready, _, _ = select.select([master], [], [], 0.1)
    if os.path.exists('/tmp/slcan.say'):
        with open('/tmp/slcan.say', 'rb') as say:
            os.write(master, say.read().strip() + b'\r')
        os.remove('/tmp/slcan.say')
    if not ready:
        continue
    waiting += os.read(master, 4096)
    *lines, waiting = waiting.split(b'\r')
    for line in lines:
        if line.startswith(b't') and len(line) >= 5:
            os.write(master, b't%03x%s\r' % ((int(line[1:4], 16) + 0x100) & 0x7ff, line[4:]))
        else:
            with open('/tmp/slcan.told', 'ab') as told:
                told.write(line + b'\n')

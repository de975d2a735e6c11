"""python-can on an interface: says what it receives in candump's log form, or sends one frame.
python_can.py INTERFACE receive COUNT | python_can.py INTERFACE send ID#DATA"""
import sys

import can

interface, action, what = sys.argv[1:4]
bus = can.Bus(interface='socketcan', channel=interface)
if action == 'send':
    can_id, data = what.split('#')
    bus.send(can.Message(arbitration_id=int(can_id, 16), is_extended_id=len(can_id) > 3, data=bytes.fromhex(data)))
else:
    print('ready', file=sys.stderr, flush=True)
    for _ in range(int(what)):
        frame = bus.recv(20)
        if frame is None:
            sys.exit('nothing came')
        width = 8 if frame.is_extended_id else 3
        print('%0*X#%s' % (width, frame.arbitration_id, frame.data.hex().upper()), flush=True)
bus.shutdown()

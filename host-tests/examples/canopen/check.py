"""A CANopen master against the simulated drive, over a virtual bus: python canopen reads the EDS, then values and abort codes are checked.

python check.py DRIVE EDS BLOCK
"""

import math
import struct
import subprocess
import sys
import threading
import time
import zlib

import can
import canopen

NODE = 5
drive_path, eds_path, block_path = sys.argv[1:]


def serve(bus, stop):
    """Carries SDO frames between the bus and the drive's standard input and output."""
    drive = subprocess.Popen([drive_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with bus:
        while not stop.is_set():
            message = bus.recv(0.05)
            if message is None or message.arbitration_id != 0x600 + NODE:
                continue
            data = bytes(message.data).ljust(8, b"\0")
            drive.stdin.write(data)
            drive.stdin.flush()
            if data[0] >> 5 != 4:
                answer = drive.stdout.read(8)
                bus.send(can.Message(arbitration_id=0x580 + NODE, data=answer, is_extended_id=False))
    drive.stdin.close()
    drive.wait()


def stamped(block, sequence):
    """The block with a sequence number, as docs/block.md says."""
    block = bytearray(block)
    block[12:16] = struct.pack("<I", sequence)
    block[-4:] = struct.pack("<I", zlib.crc32(block[:-4]))
    return bytes(block)


stop = threading.Event()
# A virtual bus keeps no frame for those who join later: the drive joins before the master sends.
server = threading.Thread(target=serve, args=(can.Bus(interface="virtual", channel="gmhm"), stop))
server.start()
checks = 0


def check(what, found, expected):
    global checks
    checks += 1
    if found != expected:
        raise SystemExit(f"{what}: {found!r}, expected {expected!r}")


def aborts(code, action, what):
    try:
        action()
    except canopen.SdoAbortedError as error:
        check(what, hex(error.code), hex(code))
    else:
        raise SystemExit(f"{what}: not aborted, expected {code:#010x}")


try:
    network = canopen.Network()
    network.connect(interface="virtual", channel="gmhm")
    node = network.add_node(NODE, eds_path)
    sdo = node.sdo
    sdo.RESPONSE_TIMEOUT = 10.0

    # What the data sheet says.
    entries = node.object_dictionary
    names = {index: entries[index].name for index in entries}
    check("names", names[0x2000], "identity")
    gain = entries[0x2004][2]
    check("type of gain_ratio", gain.data_type, canopen.objectdictionary.REAL32)
    check("access of gain_ratio", gain.access_type, "rw")
    check("unit of deflection_rad", entries[0x2002][1].unit, "rad")
    check("access of staged_block", entries[0x2005][2].access_type, "wo")
    check("type of staged_block", entries[0x2005][2].data_type, canopen.objectdictionary.DOMAIN)

    # Every object that can be read is read, and has the length of its type.
    sizes = {0x05: 1, 0x06: 2, 0x07: 4, 0x08: 4}
    for index in entries:
        entry = entries[index]
        for variable in [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values():
            if variable.access_type == "wo" or variable.data_type == canopen.objectdictionary.DOMAIN:
                continue
            length = len(sdo.upload(variable.index, variable.subindex))
            check(variable.name, length, sizes.get(variable.data_type, length))

    # Values.
    check("highest sub-index", sdo[0x2000][0].raw, 5)
    check("origin", sdo["status"]["origin"].raw, 0)
    sdo["settings"]["gain_ratio"].raw = 0.25
    check("gain ratio", sdo["settings"]["gain_ratio"].raw, 0.25)
    sdo["settings"]["bound_while_enabled"].raw = math.inf
    check("bound", sdo["settings"]["bound_while_enabled"].raw, math.inf)

    # Abort codes of CiA 301.
    aborts(0x06020000, lambda: sdo.upload(0x2100, 0), "no such index")
    aborts(0x06090011, lambda: sdo.upload(0x2004, 9), "no such sub-index")
    aborts(0x06010001, lambda: sdo.upload(0x2006, 1), "a write-only object read")
    aborts(0x06010002, lambda: sdo.download(0x2002, 1, bytes(4)), "a read-only object written")
    aborts(0x06070010, lambda: sdo.download(0x2004, 2, bytes(2)), "another length")
    aborts(0x06090030, lambda: sdo.download(0x2004, 2, struct.pack("<f", 1.5)), "a ratio above 1")
    aborts(0x06090030, lambda: sdo.download(0x2004, 2, struct.pack("<f", math.nan)), "a ratio that is no number")
    aborts(0x08000024, lambda: sdo.download(0x2004, 1, b"\1"), "compensation without parameters")
    aborts(0x08000024, lambda: sdo.download(0x2006, 1, b"\1"), "a trial of nothing")
    aborts(0x08000022, lambda: sdo.download(0x2006, 2, b"\1"), "a revert without a trial")
    aborts(0x05040005, lambda: sdo.download(0x2005, 2, bytes(1500)), "a block that is too long")

    # A block is staged, tried, read back and stored.
    packed = open(block_path, "rb").read()
    block = stamped(packed, 1)
    sdo.download(0x2005, 2, block[:-4] + bytes(4))
    aborts(0x05040004, lambda: sdo.download(0x2006, 1, b"\1"), "a damaged block tried")
    sdo.download(0x2005, 2, block)
    sdo["commands"]["try_staged_block"].raw = 1
    check("origin", sdo["status"]["origin"].raw, 2)
    check("block in force", sdo.upload(0x2005, 1), block)
    check("self-test", sdo["diagnostics"]["self_test"].raw, 1)
    aborts(0x08000020, lambda: sdo.download(0x1010, 1, b"load"), "stored with another signature")
    sdo.download(0x1010, 1, b"save")
    check("origin", sdo["status"]["origin"].raw, 1)
    sdo["settings"]["compensation_on"].raw = 1
    aborts(0x08000021, lambda: [sdo.download(0x2005, 2, stamped(packed, 2)), sdo.download(0x2006, 1, b"\1")], "a trial while compensating")
    sdo["settings"]["compensation_on"].raw = 0
    aborts(0x06090032, lambda: [sdo.download(0x2005, 2, block), sdo.download(0x2006, 1, b"\1")], "a sequence number again")
    sdo.download(0x2005, 2, stamped(packed, 2))
    sdo["commands"]["try_staged_block"].raw = 1
    sdo.download(0x1010, 1, b"save")
    check("stored sequence", sdo["status"]["stored_sequence"].raw, 2)
    sdo.download(0x1011, 1, b"load")
    check("sequence after restore", sdo["status"]["sequence"].raw, 1)
    ticks = sdo["live"]["ticks"].raw
    time.sleep(0.1)
    check("control periods pass", sdo["live"]["ticks"].raw > ticks, True)
    check("requests refused", sdo["diagnostics"]["requests_refused"].raw >= 0, True)
finally:
    network.disconnect()
    stop.set()
    server.join()
print(f"{len(names)} indices, {checks} checks")

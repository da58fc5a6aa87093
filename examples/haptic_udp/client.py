#!/usr/bin/env python3
"""A device at the other end of UDP, as a pattern for a bridge to any maker's SDK.

Start it beside

    amontons haptic examples/hapco/hexa.json --device udp:5005 --duration 5

Here a hand of 0.2 kg is simulated that presses down; a bridge reads the pose from the device
instead, and gives it the force. The packet, 64 bytes, little-endian, both ways:

    4 bytes   "AMHP" pose to amontons, "AMHF" force from it
    uint32    number of the packet, counts up; in a force: that of the newest pose received
    int64     sender's clock [ns]
    3 double  position [m]                force on the hand [N], world axes
    3 double  rotation vector [rad]       torque on the hand [N m]

The pose with the newest number counts, from any sender: a second client with higher ones takes the device over. One
number that is none (NaN, infinite) in a pose ends the force until the program is restarted.

client.py [--port 5005] [--rate 1000] [--duration 5] [--depth 0.006]
"""
import argparse
import socket
import struct
import time

PACKET = struct.Struct("<4sIq3d3d")


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--host", default="127.0.0.1")
    options.add_argument("--port", type=int, default=5005)
    options.add_argument("--rate", type=float, default=1000, help="Hz")
    options.add_argument("--duration", type=float, default=5, help="s")
    options.add_argument("--depth", type=float, default=0.006, help="target depth of the hand [m]")
    a = options.parse_args()

    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.setblocking(False)
    mass, damping, stiffness = 0.2, 6.0, 135.0  # of the hand
    z = speed = 0.0
    force = (0.0, 0.0, 0.0)
    answers = 0
    largest = 0.0
    begin = last = time.monotonic()
    number = 0
    while last - begin < a.duration:
        now = time.monotonic()
        step, last = min(now - last, 0.01), now
        # --- the device: here simulated; read yours instead ---
        target = -min(a.depth, a.depth * (now - begin) / 2)
        pull = stiffness * (target - z) - damping * speed + force[2]
        speed += step * pull / mass
        z += step * speed
        # --- pose out ---
        number += 1
        try:
            link.sendto(PACKET.pack(b"AMHP", number, time.monotonic_ns(), 0, 0, z, 0, 0, 0),
                        (a.host, a.port))
        except ConnectionError:
            pass  # no listener yet
        # --- force in: the newest ---
        while True:
            try:
                data = link.recv(128)
            except (BlockingIOError, ConnectionError):
                break
            if len(data) == PACKET.size and data[:4] == b"AMHF":
                force = PACKET.unpack(data)[3:6]
                answers += 1
                largest = max(largest, max(abs(f) for f in force))
        # --- to your device: force ---
        time.sleep(max(0.0, now + 1 / a.rate - time.monotonic()))
    print(f"{number} poses, {answers} forces, largest {largest:.3f} N")


if __name__ == "__main__":
    main()

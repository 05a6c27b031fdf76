# SPDX-License-Identifier: Apache-2.0
"""Logs that no shared recording is an example of, written from the formats' descriptions."""
import struct

OFFSETS_AT = 16 + 3 + 16  # Where the flag bits of a ULog state what was appended.


def message(kind, body):
    """A message of a ULog."""
    return struct.pack("<Hc", len(body), kind) + body


def appended_ulog(crashed=message(b"M", b"\0\x0bchar[9] key123456789")[:-4]):
    """(bytes, offsets) of a ULog of sensor_gyro whose flag bits state three places of appended data.

    Row i has the stamp 4000 i (us) and the values i, -i, 0.5; there are 0 to 99 and 150 to 299. The last
    message before each place was not written to its end, before the third it is `crashed`. Each of the first hundred rows is followed by
    information whose name has a hyphen and whose text holds letters that are types of messages.
    """
    def row(i):
        return message(b"D", struct.pack("<HQQ3f", 0, 4000 * i, 4000 * i, i, -i, 0.5))

    def information(i):
        size = 60 + i % 9
        key = f"char[{size}] perf_counter_preflight-{i:02}".encode()
        return message(b"I", bytes([len(key)]) + key + (b"mpu6k_read: MLC PLC 13036 events, " * 3)[:size])

    fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;"
    data = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message(b"B", bytes(8) + b"\1" + bytes(31)) +
                     message(b"F", f"sensor_gyro:{fields}".encode()) +
                     message(b"A", struct.pack("<BH", 0, 0) + b"sensor_gyro"))
    for i in range(100):
        data += row(i) + information(i)
    offsets = []
    for begun in (row(100)[:-9], row(100)[:2], crashed):
        data += begun
        offsets.append(len(data))
        data += b"".join(map(row, range(100 + 50 * len(offsets), 150 + 50 * len(offsets))))
    struct.pack_into("<3Q", data, OFFSETS_AT, *offsets)
    return data, offsets

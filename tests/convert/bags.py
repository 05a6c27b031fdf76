#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes ROS bags of any messages, from the formats' descriptions: for the tests to compare with.

    bags.py ros1|ros2-db3|mcap FILE FIRST COUNT     messages FIRST … of CUSTOM on /driver; ros2-db3 has no definition
    bags.py layout FILE                             that definition, for --layout

A layout is [(type, name)], as a .msg file lists fields; types are those of ROS, `float32[3]`, `float64[]`,
`Header` (stamp in ns and frame), `time` (ns), or another layout.
"""
import re
import sqlite3
import struct
import sys
import zlib
from pathlib import Path

START_NS = 1_700_000_000 * 10**9
CODES = {"bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
         "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}


class Writer:
    """Fields one after another; `is_cdr`: aligned from the begin, as ROS 2 has them."""

    def __init__(self, is_cdr, order="<"):
        self.is_cdr, self.order, self.data = is_cdr, order, b""

    def put(self, code, value):
        size = struct.calcsize(code)
        if self.is_cdr:
            self.data += bytes(-len(self.data) % size)
        self.data += struct.pack(self.order + code, value)

    def text(self, value):
        raw = value.encode() + (b"\0" if self.is_cdr else b"")
        self.put("I", len(raw))
        self.data += raw

    def time(self, ns):
        for part in divmod(ns, 10**9):
            self.put("I", part)

    def field(self, kind, value):
        array = isinstance(kind, str) and re.fullmatch(r"(.+)\[(\d*)\]", kind)
        if array:
            if not array[2]:
                self.put("I", len(value))
            for one in value:
                self.field(array[1], one)
        elif isinstance(kind, list):
            for (inner, _), one in zip(kind, value):
                self.field(inner, one)
        elif kind == "Header":
            if not self.is_cdr:
                self.put("I", 7)
            self.time(value[0])
            self.text(value[1])
        elif kind == "time":
            self.time(value)
        elif kind == "string":
            self.text(value)
        else:
            self.put(CODES[kind], value)


def message(layout, values, is_cdr, order="<"):
    """The bytes of one message."""
    writer = Writer(is_cdr, order)
    for (kind, _), value in zip(layout, values, strict=True):
        writer.field(kind, value)
    head = (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") if is_cdr else b""
    return head + writer.data


def ros1(path, topics, messages):
    """`topics`: {name: (type, definition)}; `messages`: [(topic, received ns, bytes)]."""
    def record(fields, data):
        header = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())
        return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data

    body = bytearray()
    for number, (name, (kind, definition)) in enumerate(topics.items()):
        fields = {"topic": name, "type": kind, "md5sum": "*", "message_definition": definition}
        data = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + f"{k}={v}".encode() for k, v in fields.items())
        body += record({"op": b"\7", "conn": struct.pack("<I", number), "topic": name.encode()}, data)
    numbers = {name: number for number, name in enumerate(topics)}
    for name, ns, data in messages:
        body += record({"op": b"\2", "conn": struct.pack("<I", numbers[name]),
                        "time": struct.pack("<II", *divmod(ns, 10**9))}, data)
    head = {"op": b"\3", "index_pos": bytes(8), "conn_count": struct.pack("<I", len(topics)),
            "chunk_count": struct.pack("<I", 1)}
    chunk = record({"op": b"\5", "compression": b"none", "size": struct.pack("<I", len(body))}, bytes(body))
    path.write_bytes(b"#ROSBAG V2.0\n" + record(head, b" " * 4000) + chunk)


def db3(path, topics, messages):
    """As ros1; a topic without a definition is one of before 2023."""
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
    database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    if any(definition for _, definition in topics.values()):
        database.execute("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
                         "encoded_message_definition TEXT, type_description_hash TEXT)")
    for number, (name, (kind, definition)) in enumerate(topics.items()):
        database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", (number + 1, name, kind))
        if definition:
            database.execute("INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition) "
                             "VALUES (?, 'ros2msg', ?)", (kind, definition))
    numbers = {name: number + 1 for number, name in enumerate(topics)}
    for name, ns, data in messages:
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", (numbers[name], ns, data))
    database.commit()
    database.close()


def mcap(path, topics, messages, most=10**9, is_checked=True):
    """As ros1; `most` messages a chunk, `is_checked`: with its checksum."""
    def record(kind, body):
        return struct.pack("<BQ", kind, len(body)) + body

    def text(words):
        return struct.pack("<I", len(words.encode())) + words.encode()

    known = b""
    for number, (name, (kind, definition)) in enumerate(topics.items()):
        known += record(3, struct.pack("<H", number + 1) + text(kind) + text("ros2msg") + text(definition))
        known += record(4, struct.pack("<HH", number, number + 1) + text(name) + text("cdr") + struct.pack("<I", 0))
    numbers = {name: number for number, name in enumerate(topics)}
    chunks = bytearray()
    for begin in range(0, len(messages), most):
        body = bytearray(known)
        for name, ns, data in messages[begin:begin + most]:
            body += record(5, struct.pack("<HIQQ", numbers[name], 0, ns, ns) + data)
        checksum = zlib.crc32(body) if is_checked else 0
        chunks += record(6, struct.pack("<QQQI", 0, 0, len(body), checksum) + text("") + struct.pack("<Q", len(body)) + bytes(body))
    path.write_bytes(b"\x89MCAP0\r\n" + record(1, text("ros2") + text("")) + chunks + record(15, bytes(4)) +
                     record(2, bytes(20)) + b"\x89MCAP0\r\n")


# A driver's own message.
SAMPLE = [("int16[3]", "acc"), ("float32", "temp")]
CUSTOM = [("uint8", "unit"), ("uint64", "t_us"), ("string", "note"), (SAMPLE, "low"), ("float64[]", "all"),
          ("bool", "ok"), ("float32", "gx"), ("float32", "gy"), ("float32", "gz"), ("int8[5]", "rest")]
CUSTOM_TEXT = ("# of a driver\nuint8 RANGE=4\nuint8 unit 1\nuint64 t_us # counts up\nstring note\nmine/{0}Sample low\n"
               "float64[] all\n\nbool ok\nfloat32 gx\nfloat32 gy\nfloat32 gz\nint8[5] rest\n" + "=" * 80 +
               "\nMSG: mine/{0}Sample\nint16[3] acc\nfloat32 temp\n")


def custom_values(i):
    """Message i of CUSTOM, 2.5 ms behind the one before."""
    return [3, 10**9 + 2500 * i, "n" * (i % 5), [[i, -i, 4096], 20 + i / 8], [0.5] * (i % 4) + [i, 2, 3], i % 2,
            0.1 * i, -0.2 * i, 0.3, [1, 2, 3, 4, 5]]


def write_custom(kind, path, first, count, **more):
    """Messages first … of CUSTOM on /driver; `ros2-db3` without the definition."""
    write, is_cdr = {"ros1": (ros1, False), "ros2-db3": (db3, True), "mcap": (mcap, True)}[kind]
    text = "" if kind == "ros2-db3" else CUSTOM_TEXT.format("msg/" if is_cdr else "")
    write(path, {"/driver": ("mine/msg/Reading" if is_cdr else "mine/Reading", text)},
          [("/driver", START_NS + 2_500_000 * i, message(CUSTOM, custom_values(i), is_cdr))
           for i in range(first, first + count)], **more)


def main():
    kind, path = sys.argv[1], Path(sys.argv[2])
    if kind == "layout":
        path.write_text(CUSTOM_TEXT.format(""))
    else:
        write_custom(kind, path, *map(int, sys.argv[3:]))


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: Apache-2.0
"""Readers of ULog and MCAP written from the formats' descriptions, for the tests to compare with."""
import struct
from pathlib import Path

SIZES = {"int8_t": "b", "uint8_t": "B", "bool": "?", "char": "c", "int16_t": "h", "uint16_t": "H",
         "int32_t": "i", "uint32_t": "I", "int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d"}


def ulog_rows(path):
    """{(topic, instance): [{field: value or tuple}]} of topics without nested messages."""
    data = Path(path).read_bytes()
    assert data[:7] == b"ULog\x01\x12\x35"
    formats, topics, rows, appended = {}, {}, {}, []
    at = 16
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<Hc", data, at)
        if appended and at + 3 + size > appended[0]:
            at = appended.pop(0)  # The message before was not written to its end.
            continue
        body = data[at + 3:at + 3 + size]
        at += 3 + size
        if kind == b"B" and body[8] & 1:
            appended = [offset for offset in struct.unpack_from("<3Q", body, 16) if offset]
        elif kind == b"F":
            name, fields = body.decode().split(":", 1)
            formats[name] = [field.split(" ") for field in fields.split(";") if field]
        elif kind == b"A":
            instance, number = struct.unpack_from("<BH", body)
            topics[number] = (body[3:].decode(), instance)
        elif kind == b"D":
            topic = topics[struct.unpack_from("<H", body)[0]]
            row, begin, nested = {}, 2, False
            for kind_of, name in formats[topic[0]]:
                base, _, length = kind_of.partition("[")
                if base not in SIZES:
                    nested = True
                    break
                length = int(length[:-1]) if length else 1
                layout = "<%d%s" % (length, SIZES[base])
                if begin + struct.calcsize(layout) > len(body):
                    break  # Padding that is not written.
                values = struct.unpack_from(layout, body, begin)
                row[name] = values if length > 1 else values[0]
                begin += struct.calcsize(layout)
            if not nested:
                rows.setdefault(topic, []).append(row)
    return rows


def mcap_messages(path):
    """[(topic, CDR bytes)] of a file whose chunks are not compressed."""
    data = Path(path).read_bytes()
    topics, messages = {}, []

    def records(begin, end):
        while begin + 9 <= end:
            kind, size = struct.unpack_from("<BQ", data, begin)
            body = begin + 9
            if kind == 4:
                number, _, length = struct.unpack_from("<HHI", data, body)
                topics[number] = data[body + 8:body + 8 + length].decode()
            elif kind == 5:
                number = struct.unpack_from("<H", data, body)[0]
                messages.append((topics[number], data[body + 22:body + size]))
            elif kind == 6:
                name = struct.unpack_from("<I", data, body + 28)[0]
                assert name == 0
                records(body + 40, body + size)
            begin = body + size

    records(8, len(data) - 8)
    return messages


def header_of(cdr):
    """Time in ns, and where the next field begins (behind the encapsulation)."""
    seconds, nanoseconds, length = struct.unpack_from("<iII", cdr, 4)
    return seconds * 10**9 + nanoseconds, 16 + length


def doubles(cdr, at, count):
    at = 4 + (at - 4 + 7) // 8 * 8
    return struct.unpack_from("<%dd" % count, cdr, at)

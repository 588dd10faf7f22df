"""A client that speaks HTTP/2 frame by frame over TLS (RFC 9113, RFC 7541), to send what no gRPC client would send."""
import base64
import socket
import ssl
import struct

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RESET, SETTINGS, PING, GOAWAY, WINDOW_UPDATE = 0, 1, 3, 4, 6, 7, 8
WIDEST_WINDOW = struct.pack(">I", 2**31 - 1 - 65535)  # beyond the first one
END_STREAM, END_HEADERS, ACK = 0x1, 0x4, 0x1
CANCEL = struct.pack(">I", 8)
EMPTY_MESSAGE = bytes(5)  # a gRPC message: not compressed, no bytes


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(text):
    """A length with a prefix of 7 bits (RFC 7541, section 5.1), then the text without Huffman's code."""
    raw, left = text.encode(), len(text.encode())
    if left < 127:
        return bytes([left]) + raw
    out, left = bytes([127]), left - 127
    while left >= 128:
        out, left = out + bytes([left % 128 + 128]), left // 128
    return out + bytes([left]) + raw


def header_block(path, more=()):
    fields = [(":method", "POST"), (":scheme", "https"), (":path", path), (":authority", "raw"),
              ("te", "trailers"), ("content-type", "application/grpc"), *more]
    return b"".join(b"\0" + literal(name) + literal(value) for name, value in fields)


def admission(ticket, room):
    """The headers that each call of a person has."""
    room_in_base64 = base64.b64encode(room.encode()).decode().rstrip("=")
    return (("osteon-ticket", ticket), ("osteon-room-bin", room_in_base64))


class Connection:
    """Errors: OSError (ssl.SSLError among them) if the other side closes the connection or does not complete the
    handshake."""

    def __init__(self, address, person=None, patience_s=10.0, source="127.0.0.1"):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        context.set_alpn_protocols(["h2"])
        if person:
            context.load_cert_chain(person / "person.pem", person / "person.key")
        plain = socket.create_connection(address, timeout=patience_s, source_address=(source, 0))
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.line = context.wrap_socket(plain)
        self.arrived = b""
        self.stream = -1
        self.line.sendall(PREFACE + frame(SETTINGS, 0, 0) + frame(WINDOW_UPDATE, 0, 0, WIDEST_WINDOW))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()

    def next_stream(self):
        self.stream += 2
        return self.stream

    def call(self, path, more=(), message=EMPTY_MESSAGE):
        """Begins a call and sends its whole request. Returns its stream."""
        stream = self.next_stream()
        self.line.sendall(frame(HEADERS, END_HEADERS, stream, header_block(path, more)) +
                          frame(DATA, END_STREAM, stream, message))
        return stream

    def resets(self, path, count, more=()):
        """Begins and resets `count` calls, as fast as they can be sent."""
        block, out = header_block(path, more), bytearray()
        for _ in range(count):
            stream = self.next_stream()
            out += frame(HEADERS, END_HEADERS, stream, block) + frame(RESET, 0, stream, CANCEL)
        self.line.sendall(out)

    def read(self):
        """Returns the next frame as (kind, flags, stream, payload). Answers it if it needs an answer. None at the
        end."""
        while True:
            while len(self.arrived) < 9 or len(self.arrived) < 9 + int.from_bytes(self.arrived[:3], "big"):
                more = self.line.recv(65536)
                if not more:
                    return None
                self.arrived += more
            size, kind, flags = int.from_bytes(self.arrived[:3], "big"), self.arrived[3], self.arrived[4]
            stream, payload = int.from_bytes(self.arrived[5:9], "big"), self.arrived[9:9 + size]
            self.arrived = self.arrived[9 + size:]
            if kind in (SETTINGS, PING) and not flags & ACK:
                self.line.sendall(frame(kind, ACK, 0, payload if kind == PING else b""))
            return kind, flags, stream, payload

    def finish(self, stream):
        """Reads until that call is over. Returns whether it was answered with a message."""
        answered = False
        while (next_frame := self.read()) is not None:
            kind, flags, of, _ = next_frame
            if of != stream:
                continue
            answered = answered or kind == DATA
            if kind == RESET or (kind in (HEADERS, DATA) and flags & END_STREAM):
                return answered
        return False

"""The wire format: the provenance of a message's tracked fields as bytes. docs/wire_format.md describes it.

`encoder` writes it and `decoder` reads it. Both share the parts: numbers of variable length (`varint`), the tables in
front (`table_writer`, `table_reader`), and the expressions that are not affine (`expressions`).
"""

from rosslt.messages.codec.decoder import NO_READINGS, Readings, attach, make_unknown
from rosslt.messages.codec.encoder import Encoding, encode, encoding_to_send
from rosslt.messages.codec.wire_format import SAMPLED

"""The wire format: the provenance of a message's tracked fields as bytes. docs/wire_format.md describes it.

`encoder` writes it and `decoder` reads it. Both share the parts: numbers of variable length (`varint`), the tables in
front (`table_writer`, `table_reader`), the expressions that are not affine (`expressions`), and templates of what was
written or read not long ago (`templates`).
"""

from rosslt.messages.codec.decoder import attach
from rosslt.messages.codec.encoder import encode, provenance_to_send

__all__ = ['attach', 'encode', 'provenance_to_send']

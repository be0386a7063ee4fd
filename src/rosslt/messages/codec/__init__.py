"""The wire format: the provenance of a message's tracked fields as bytes. docs/wire_format.md describes it.

`encoder` writes it and `decoder` reads it. Both share the parts: numbers of variable length (`varint`), the tables in
front (`table_writer`, `table_reader`), the expressions that are not affine (`expressions`), and templates of what was
written or read not long ago (`templates`). `sparing` limits the time that is spent on writing. `announcing` says what
is sent in full and what by a reference, which `outlines` resolves.
"""

from rosslt.messages.codec.announcing import Announcer
from rosslt.messages.codec.decoder import ReceivedHeader, attach, header_like
from rosslt.messages.codec.encoder import encode, provenance_to_send
from rosslt.messages.codec.outlines import OUTLINES
from rosslt.messages.codec.sparing import Allowance, SparingProvenance

__all__ = [
    'OUTLINES',
    'Allowance',
    'Announcer',
    'ReceivedHeader',
    'SparingProvenance',
    'attach',
    'encode',
    'header_like',
    'provenance_to_send',
]

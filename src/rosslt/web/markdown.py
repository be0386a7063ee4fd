"""Texts of others in Markdown, as they are: the page's Markdown may hold expressions that a browser evaluates."""


def code(text: str) -> str:
    """A text within a line."""
    return '`{}`'.format(' '.join(text.replace('`', "'").split()) or ' ')


def block(text: str, language: str = '') -> str:
    """A text of several lines; what could not be decoded in it, of a file in another encoding, becomes a `?`."""
    readable = text.encode('utf-8', 'replace').decode('utf-8')
    return '```{}\n{}\n```'.format(language, readable.replace('`', "'"))

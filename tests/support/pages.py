"""What a reader sees of a page: its elements with their attributes, and its text without scripts and styles."""

from html.parser import HTMLParser


class Page(HTMLParser):
    """All elements of a page with their attributes, and the words of the text outside scripts and styles."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.words, self._hidden = [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag in ("script", "style"):
            self._hidden = tag

    def handle_endtag(self, tag):
        if tag == self._hidden:
            self._hidden = None

    def handle_data(self, data):
        if self._hidden is None:
            self.words.append(data)

    @property
    def text(self):
        return "".join(self.words)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]

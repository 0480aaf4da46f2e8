"""Tables of the benches: plain or Markdown."""


def show(head, rows, markdown, width=18):
    """Print a table of strings.

    Parameters
    ----------
    head : list of str
    rows : iterable of list of str
    markdown : bool
    width : int
        Of a column of a plain table.
    """
    if markdown:
        lines = [head, ["---"] * len(head), *rows]
        print("\n".join(f"| {' | '.join(line)} |" for line in lines))
    else:
        print("\n".join("  ".join(cell.ljust(width) for cell in line) for line in [head, *rows]))

// Tables marked `data-sort` are sorted by a click on a column's head, again the other way; empty cells stay last.
document.querySelectorAll('table[data-sort]').forEach((table) => {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement('button');
    button.type = 'button';
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener('click', () => {
      const down = head.getAttribute('aria-sort') === 'ascending';
      heads.forEach((other) => other.removeAttribute('aria-sort'));
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      const body = table.tBodies[0];
      const key = (row) => row.cells[column].dataset.value || '';
      const order = (a, b) => {
        const [p, q] = [key(a), key(b)];
        if (p === '' || q === '') return (p === '') - (q === '');
        const numbers = p - q;
        const by = Number.isNaN(numbers) ? p.localeCompare(q) : numbers;
        return down ? -by : by;
      };
      [...body.rows].sort(order).forEach((row) => body.append(row));
    });
  });
});

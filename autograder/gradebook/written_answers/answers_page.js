'use strict';
const data = JSON.parse(document.getElementById('data').textContent);
const articles = [...document.querySelectorAll('article')];
const store = 'marks ' + data.key;
const saved = JSON.parse(localStorage.getItem(store) || '{}');
const fields = (article) => [article.querySelector('input'), article.querySelector('textarea')];
const right = (input) => input.value === '' ? !input.validity.badInput : input.validity.valid;
function show() {
  let done = 0;
  for (const article of articles) {
    const [points] = fields(article);
    const marked = points.value !== '' && right(points);
    article.classList.toggle('done', marked);
    done += marked;
  }
  document.getElementById('done').textContent = done + ' of ' + articles.length + ' marked';
}
function keep() {
  const now = {};
  articles.forEach((article, number) => {
    const [points, comment] = fields(article);
    now[data.rows[number].state] = [points.value, comment.value];
  });
  localStorage.setItem(store, JSON.stringify(now));
  show();
}
articles.forEach((article, number) => {
  const [points, comment] = fields(article);
  const before = saved[data.rows[number].state];
  if (before) [points.value, comment.value] = before;
  article.addEventListener('input', keep);
  article.addEventListener('click', (event) => {
    if (event.target.dataset.points === undefined) return;
    points.value = event.target.dataset.points;
    keep();
    points.focus();
  });
});
const formula = (text) => /^\s*[=+\-@\t\r\n\0\uFF1D\uFF0B\uFF0D\uFF20]/.test(text);
const cell = (text) => '"' + (formula(text) ? "'" + text : text).replaceAll('"', '""') + '"';
document.getElementById('save').addEventListener('click', () => {
  const wrong = articles.map((article) => fields(article)[0]).find((points) => !right(points));
  if (wrong) { wrong.reportValidity(); return; }
  const lines = [data.columns.map(cell).join(',')];
  articles.forEach((article, number) => {
    const [points, comment] = fields(article);
    const row = { ...data.common, ...data.rows[number],
      points: points.value, comment: comment.value };
    lines.push(data.columns.map((name) => cell(row[name])).join(','));
  });
  const link = document.createElement('a');
  const text = lines.join("\r\n") + "\r\n";
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = data.file;
  link.click();
});
show();

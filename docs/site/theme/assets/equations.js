for (const element of document.querySelectorAll('.arithmatex')) {
  renderMathInElement(element, {throwOnError: false, delimiters: [
    {left: '\\(', right: '\\)', display: false}, {left: '\\[', right: '\\]', display: true}]});
}

// Says of which version a page is, and leads to the same page of another: their folders stand side by side.
{
  const root = new URL('..', document.currentScript.src);
  const own = decodeURIComponent(root.pathname.split('/').at(-2));
  const page = decodeURIComponent(location.pathname).slice(decodeURIComponent(root.pathname).length);
  const versions = globalThis.__versions ?? {[own]: []};  // a version's folder may have been copied alone
  const address = (version) => new URL(`../${version}/${versions[version].includes(page) ? page : 'index.html'}`, root).href;

  const select = document.createElement('select');
  select.className = 'version';
  select.ariaLabel = 'Version';
  select.title = document.querySelector('.md-copyright')?.textContent.trim() ?? '';
  select.autocomplete = 'off';  // who comes back finds this page's version
  for (const version of Object.keys(versions)) select.add(new Option(version, version, false, version === own));
  select.onchange = () => { location.href = address(select.value); };
  document.querySelector('.md-header__title').after(select);

  const [newest] = Object.keys(versions);
  if (own !== newest) {
    const remark = document.createElement('p');
    remark.className = 'admonition warning';
    const link = document.createElement('a');
    link.href = address(newest);
    link.textContent = newest;
    remark.append(`This page is of ${own}. There is another version: `, link);
    document.querySelector('.md-content__inner').prepend(remark);
  }
}

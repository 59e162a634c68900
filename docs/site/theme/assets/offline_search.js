// The theme's search without a server: a page from a file may neither fetch the index nor start a worker from a file.
if (location.protocol === 'file:') {
  const NativeWorker = window.Worker;
  const address = new URL('../search/search_index.js', document.currentScript.src);

  // A script of some MB, which most pages are read without: it is loaded for who searches, or comes from a search.
  const loaded = new Promise((resolve) => {
    const load = () => {
      const script = document.createElement('script');
      script.src = address;
      script.onload = resolve;
      document.head.append(script);
    };
    const look = ({target}) => {
      if (!target.matches('.md-search__input')) return;
      removeEventListener('focusin', look);
      load();
    };
    if (location.search) load();
    else addEventListener('focusin', look);
  });

  // What the theme sends to its worker waits until the script has come.
  window.Worker = class extends EventTarget {
    constructor() {
      super();
      this.worker = loaded.then(() => {
        const url = URL.createObjectURL(new Blob([window.__search_worker], {type: 'text/javascript'}));
        const worker = new NativeWorker(url);
        worker.onmessage = ({data}) => this.dispatchEvent(new MessageEvent('message', {data}));
        return worker;
      });
    }

    postMessage(message) { this.worker.then((worker) => worker.postMessage(message)); }
  };
  window.__search = {index: loaded.then(() => window.__index)};
}

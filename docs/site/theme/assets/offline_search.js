// The theme's search without a server: a page from a file may neither fetch the index nor start a worker from a file.
if (location.protocol === 'file:') {
  const NativeWorker = window.Worker;
  const script = document.createElement('script');
  script.src = new URL('../search/search_index.js', document.currentScript.src);
  const loaded = new Promise((resolve) => { script.onload = () => resolve(); });
  document.head.append(script);  // beside the page, which is shown meanwhile

  // The theme makes its worker before the script has come: what it sends waits for it.
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

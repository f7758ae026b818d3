// A file that is dropped anywhere on the page goes the way of one that is chosen by the Open button. On a row of the
// list of fins it is for that fin. Several files, or a folder, are refused by the server.
(() => {
  if (window.finlabOpening) return;
  window.finlabOpening = true;
  const page = document.documentElement;
  const isFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files');
  const show = (over) => page.classList.toggle('fl-dropping', over);

  const listen = (kind, hear) => window.addEventListener(kind, (event) => isFiles(event) && hear(event), { capture: true });
  listen('dragover', (event) => {
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    show(true);
  });
  listen('dragleave', (event) => { if (!event.relatedTarget) show(false); });
  listen('drop', (event) => {
    event.preventDefault();
    event.stopPropagation();
    show(false);
    const { tell } = window.finlabPresses;
    const { files, items } = event.dataTransfer;
    if (files.length !== 1 || items[0].webkitGetAsEntry?.()?.isDirectory) return void tell('dropped', '', '');
    const row = event.target.closest?.('.fin-list [data-press=fin]');
    if (row) tell('fin', row.dataset.key, '');
    const box = document.querySelector('div:has(> .fl-file) ~ div input[type=file]');
    box.files = files;
    box.dispatchEvent(new Event('change', { bubbles: true }));
  });

  // The design in the address that the page was opened with.
  function openLinked(hash) {
    if (!hash.startsWith('#design=')) return;
    window.finlabPresses.tell('design-link', '', hash.slice(1));
    history.replaceState(null, '', location.pathname + location.search); // a reload goes on with what was made of it
  }

  // viser rewrites the address before anything of ours runs; how the page was entered is remembered elsewhere.
  function enteredWith() {
    const [entry] = performance.getEntriesByType('navigation');
    return location.hash || new URL(entry?.name ?? location.href).hash;
  }

  const begin = () => {
    if (!window.finlabPresses?.ready()) return setTimeout(begin, 50);
    openLinked(enteredWith());
  };
  window.addEventListener('hashchange', () => openLinked(location.hash));
  begin();
})();

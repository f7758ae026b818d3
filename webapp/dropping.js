// Files that are dropped anywhere on the page. The server hears their names first, and says when to send each; then it
// goes the way of one that is chosen by the Open button. On a row of the list of fins it is for that fin.
(() => {
  if (window.finlabDropping) return;
  const page = document.documentElement;
  const isFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files');
  const show = (over) => page.classList.toggle('fl-dropping', over);
  let held = [];

  window.finlabDropping = {
    sendNext(tries = 0) {
      // viser only closes the note of the upload that it heard of last
      if (document.querySelector('.mantine-Notification-loader') && tries < 40)
        return void setTimeout(() => this.sendNext(tries + 1), 50);
      const file = held.shift(), one = new DataTransfer();
      if (!file) return;
      one.items.add(file);
      const box = document.querySelector('div:has(> .fl-file) ~ div input[type=file]');
      box.files = one.files;
      box.dispatchEvent(new Event('change', { bubbles: true }));
    },
  };

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
    const row = event.target.closest?.('.fin-list [data-press=fin]');
    if (row) tell('fin', row.dataset.key, '');
    const items = [...event.dataTransfer.items].filter((item) => item.kind === 'file');
    const folders = items.map((item) => item.webkitGetAsEntry?.()?.isDirectory ?? false);
    held = items.map((item) => item.getAsFile());
    tell('dropped', '', JSON.stringify(held.map((file, k) => [file.name, file.size, folders[k]])));
  });
})();

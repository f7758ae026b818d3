// Designs in links: the one in the address that the page was opened with, and the link that shares one.
(() => {
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

  function copy(box) {
    box.select();
    if (navigator.clipboard) return navigator.clipboard.writeText(box.value).then(() => true, () => document.execCommand('copy'));
    return Promise.resolve(document.execCommand('copy'));
  }

  function share(fragment, name) {
    document.querySelector('.fl-share')?.remove();
    const card = document.createElement('div');
    card.className = 'fl-share';
    card.setAttribute('role', 'dialog');
    card.setAttribute('aria-label', 'Share the design');
    card.innerHTML = '<b></b><p></p><input readonly aria-label="link"><div class="row"><button class="primary">Copy the link</button>'
      + '<button>Close</button></div>';
    card.querySelector('b').textContent = `Share ${name}`;
    card.querySelector('p').textContent = 'The link carries the whole design. Whoever opens it gets a copy, on a finlab of their own.';
    const box = card.querySelector('input'), [take, close] = card.querySelectorAll('button');
    // Without a query viser's page would take what stands behind the # for a part of its server's name.
    box.value = `${location.origin}${location.pathname}?shared#${fragment}`;
    take.onclick = () => copy(box).then((done) => { take.textContent = done ? 'Copied' : 'Press Ctrl+C'; });
    close.onclick = () => card.remove();
    card.onkeydown = (event) => {
      event.stopPropagation();
      if (event.key === 'Escape') card.remove();
    };
    document.body.append(card);
    take.focus();
  }

  const isFirst = !window.finlabDesigns; // else the connection was lost, and the page is the same
  if (isFirst) window.addEventListener('hashchange', () => openLinked(location.hash));
  window.finlabDesigns = { share };
  const begin = () => {
    if (!window.finlabPresses?.ready()) return setTimeout(begin, 50);
    openLinked(enteredWith());
  };
  if (isFirst) begin();
})();

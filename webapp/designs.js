// The design in the address that the page was opened with.
(() => {
  if (window.finlabDesigns) return; // the connection was lost, and the page is the same
  window.finlabDesigns = true;

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

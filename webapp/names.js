// Names for boxes and sliders that have none of their own: viser ties a row's label to one element of the row at most,
// so a reader of the screen would hear only "edit text, 0.5". Each is called as its row, of several with its place.
(() => {
  if (window.finlabNames) return;
  window.finlabNames = true;
  let asked = 0;
  document.getElementById('root').role = 'main';  // all that viser draws; it has no landmark

  function name() {
    asked = 0;
    const list = document.querySelector('.mantine-Spotlight-content');
    list?.setAttribute('aria-label', 'Commands');
    list?.querySelector('[data-scrollarea-viewport]')?.setAttribute('tabindex', '0');
    for (const label of document.querySelectorAll('label[for]')) {
      const row = label.closest('.mantine-Flex-root');
      const found = row ? [...row.querySelectorAll('input:not([type=hidden]):not([type=file]), textarea, [role=slider]')] : [];
      const alike = (box) => found.filter((other) => other.getAttribute('role') === box.getAttribute('role'));
      for (const box of found) {
        const kin = alike(box), place = kin.length > 1 ? `, ${kin.indexOf(box) + 1} of ${kin.length}` : '';
        if (box.id === label.htmlFor && !place) continue;
        const called = label.textContent + place;
        if (box.getAttribute('aria-label') !== called) box.setAttribute('aria-label', called);
      }
    }
  }

  new MutationObserver(() => { asked ||= setTimeout(name, 100); }).observe(
    document.body, { childList: true, subtree: true, characterData: true });
  name();
})();

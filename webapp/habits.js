// What the page of viser does otherwise: with Ctrl the camera stays where it is, and the server is told which tab
// is open and how wide the window has become.
(() => {
  if (window.finlabHabits) return;
  window.finlabHabits = true;
  const MOVES = /^(Key[WASDQE]|Arrow)/;
  window.addEventListener('keydown', (event) => {
    if ((event.ctrlKey || event.metaKey || event.altKey) && MOVES.test(event.code)) event.stopImmediatePropagation();
  }, { capture: true });

  const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
  let told = '', timer = 0;
  function tell() {
    const box = document.querySelector('div:has(>.fl-habits) + div input');
    const tab = document.querySelector('[role=tablist] [role=tab][aria-selected=true]')?.innerText.trim();
    const word = `${tab ?? ''},${window.innerWidth}`;
    if (!box || word === told) return;
    told = word;
    value.set.call(box, word);
    box.dispatchEvent(new Event('input', { bubbles: true }));
  }
  const soon = () => { clearTimeout(timer); timer = setTimeout(tell, 120); };
  window.addEventListener('resize', soon);
  window.addEventListener('click', soon, { capture: true });
  window.addEventListener('keyup', soon, { capture: true });
  soon();
})();

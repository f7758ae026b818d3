// A page that follows another one (`panels/following.py`): whom it follows stands in its address, `?follow=CODE`.
(() => {
  if (window.finlabFollowing) return;
  const entered = performance.getEntriesByType('navigation')[0]?.name ?? location.href;
  const ofAddress = (address) => new URL(address).searchParams.get('follow');
  let code = ofAddress(location.href) ?? ofAddress(entered) ?? '';

  window.finlabFollowing = {
    begin() { if (code) window.finlabPresses.tell('follow', code, ''); },
    // A reload goes on with what is this page's own.
    leave() {
      code = '';
      const address = new URL(location.href);
      address.searchParams.delete('follow');
      history.replaceState(null, '', address);
    },
  };
})();

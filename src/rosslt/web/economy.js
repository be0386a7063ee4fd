// What a browser that draws with the processor does without, so that the page stays fluent there: smooth edges, shadows
// around what lies over the view, an empty picture behind all things, and many of the pixels while things move.
//
// It stands at the head of the page, before viser's own script, and relies on this:
// - three.js asks for its WebGL context with `antialias`, and begins each frame with a call of `clear`;
// - viser draws as long as something moves, for a quarter of a second after each change, and else once a second;
// - `__viserTestpoints.devSettings`, which viser keeps for its own tests, takes `fixedDpr`, as the page's address does:
//   how many pixels are drawn for each that is shown. Without it, all pixels are always drawn;
// - `__viserMutable.backgroundMaterial`, which viser keeps for its own tests, too, is what the picture is drawn with.
(() => {
  'use strict';

  // The shares of the pixels that may be drawn, in each direction.
  const SHARES = [1, 0.75, 0.5, 0.35];
  // What takes longer than SLOW is drawn with fewer pixels; with more again what would take less than FAST then; in ms.
  const SLOW = 45;
  const FAST = 40;
  // So many frames in a row tell how long one takes.
  const ENOUGH = 3;
  // What moves for no longer than this, in ms, is one change, and is drawn with all pixels.
  const ONE_CHANGE = 400;
  // After so long without a new frame, in ms, all stands still.
  const REST = 200;
  // A shadow is laid over the 3D view anew in each frame.
  const STYLE = `.mantine-Paper-root, .mantine-Notification-root {
    box-shadow: none !important;
    border: 1px solid #8886;
  }`;

  const getContext = HTMLCanvasElement.prototype.getContext;

  const drawsWithProcessor = () => {
    const probe = getContext.call(document.createElement('canvas'), 'webgl2');
    const names = probe?.getExtension('WEBGL_debug_renderer_info');
    const name = names ? probe.getParameter(names.UNMASKED_RENDERER_WEBGL) : '';
    probe?.getExtension('WEBGL_lose_context')?.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  };

  const median = numbers => [...numbers].sort((one, other) => one - other)[numbers.length >> 1];

  // The share with which frames are in time that take `took` ms with another one.
  const better = (share, took) => {
    const wouldTake = other => took * (other / share) ** 2; // no longer, if it is more; no less, if it is less
    const fewer = SHARES.filter(other => other < share);
    if (took > SLOW && fewer.length) return fewer.find(other => wouldTake(other) < SLOW) ?? fewer.at(-1);
    const more = SHARES.filter(other => other > share).at(-1);
    return more && wouldTake(more) < FAST ? more : share;
  };

  // Draw with as many pixels as there is time for, and with all of them once nothing moves.
  const adapt = () => {
    let share = 1;
    let begun = 0; // when things began to move; 0: all stands still
    let last = 0; // when the last frame was begun; 0 after a pause
    let took = []; // by the last frames
    let isFollowed = false;
    let hasDrawn = false; // since the last tick
    let rest; // the timer of a pause

    const draw = chosen => {
      share = chosen;
      took = [];
      last = 0;
      const all = Math.min(Math.max(devicePixelRatio, 1), 2); // as react-three-fiber has it
      // once this frame is shown: the view loses what it shows as it changes its size
      setTimeout(() => window.__viserTestpoints?.devSettings?.set({ fixedDpr: share * all }));
    };

    const tick = now => {
      isFollowed = hasDrawn;
      if (!hasDrawn) {
        last = 0;
        rest = setTimeout(() => {
          begun = 0;
          draw(1);
        }, REST);
        return;
      }
      hasDrawn = false;
      begun ||= now;
      requestAnimationFrame(tick);
      if (last) took.push(now - last);
      last = now;
      if (took.length < ENOUGH) return;
      const chosen = now - begun > ONE_CHANGE ? better(share, median(took)) : share;
      if (chosen !== share) draw(chosen);
      else took.shift();
    };

    return () => {
      hasDrawn = true;
      if (isFollowed) return;
      isFollowed = true;
      clearTimeout(rest);
      requestAnimationFrame(tick);
    };
  };

  // viser lays a picture behind all things, over the whole view, whether or not it has one.
  const leaveOutEmptyPicture = () => {
    const picture = window.__viserMutable?.backgroundMaterial;
    if (picture) picture.visible = picture.uniforms.enabled.value;
  };

  if (!drawsWithProcessor()) return;
  document.head.append(Object.assign(document.createElement('style'), { textContent: STYLE }));
  const isChosen = new URLSearchParams(location.search).has('fixedDpr');
  HTMLCanvasElement.prototype.getContext = function (kind, wishes) {
    if (kind !== 'webgl2' || !wishes?.antialias) return getContext.call(this, kind, wishes);
    const context = getContext.call(this, kind, { ...wishes, antialias: false });
    if (!context) return context;
    const follow = isChosen ? () => {} : adapt();
    const clear = context.clear;
    context.clear = function (mask) {
      follow();
      leaveOutEmptyPicture();
      return clear.call(this, mask);
    };
    return context;
  };
})();

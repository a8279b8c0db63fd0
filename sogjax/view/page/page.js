"use strict";
(() => {
  const known = JSON.parse(document.getElementById("data").textContent);
  const screen = document.getElementById("screen");
  if (!screen || !known.pictures || !known.pictures.length) return;
  const slider = document.getElementById("frame"), said = document.getElementById("said");
  const play = document.getElementById("play"), plots = [...document.querySelectorAll(".plot")];
  const frames = known.pictures.map(([frame]) => frame);
  let timer = null;

  const nearest = (list, frame) => {
    let best = 0;
    list.forEach((each, k) => { if (Math.abs(each - frame) < Math.abs(list[best] - frame)) best = k; });
    return best;
  };
  const element = (name, content) => Object.assign(document.createElement(name), { textContent: content });

  const show = (wanted) => {
    const row = nearest(known.frames, wanted), frame = known.frames[row], k = nearest(frames, frame);
    slider.value = frame;
    if (screen.src !== known.pictures[k][1]) screen.src = known.pictures[k][1];
    const time = `${(frame / known.fps).toFixed(2)} s`;
    screen.alt = `The cameras' pictures of frame ${frames[k]} with the skeleton over them`;
    slider.setAttribute("aria-valuetext", `frame ${frame}, ${time}`);
    said.replaceChildren(element("b", `Frame ${frame}`), `, ${time}`);
    if (frames[k] !== frame) said.append(` (picture of frame ${frames[k]})`);
    known.actors.forEach((actor) => {
      const parts = [];
      if (actor.explained) parts.push(`${actor.explained[row]} % explained`);
      const limbs = actor.limbs.map((name, limb) => [name, actor.sure[limb][row], actor.doubted[limb][row]]);
      const low = limbs.filter(([, , doubted]) => doubted);
      low.sort((a, b) => a[1] - b[1]).slice(0, 3).forEach(([name, sure]) => parts.push(`${name} ${sure} % sure`));
      if (!low.length && actor.limbs.length) parts.push("all limbs sure");
      const whose = known.actors.length > 1 ? `${actor.name}: ` : "";
      said.append(document.createElement("br"), whose + parts.join(", "));
    });
    plots.forEach((plot) => {
      const { left, right, first, last } = plot.dataset, cursor = plot.querySelector(".cursor");
      const share = (frame - first) / (last - first);
      cursor.style.left = `${100 * (+left + share * (right - left))}%`;
      cursor.style.display = "block";
    });
  };
  const stop = () => { clearInterval(timer); timer = null; play.textContent = "Play"; };
  const turn = (step) => {
    const k = nearest(frames, +slider.value) + step;
    show(frames[(k + frames.length) % frames.length]);
  };

  slider.addEventListener("input", () => { stop(); show(+slider.value); });
  document.getElementById("before").addEventListener("click", () => { stop(); turn(-1); });
  document.getElementById("after").addEventListener("click", () => { stop(); turn(1); });
  play.addEventListener("click", () => {
    if (timer) { stop(); return; }
    play.textContent = "Pause";
    timer = setInterval(() => turn(1), 200);
  });
  plots.forEach((plot) => plot.addEventListener("click", (event) => {
    const { left, right, first, last } = plot.dataset, box = plot.getBoundingClientRect();
    const share = ((event.clientX - box.left) / box.width - left) / (right - left);
    stop();
    show(+first + Math.min(Math.max(share, 0), 1) * (last - first));
  }));
  const fromAddress = () => {
    const found = /^#frame=(\d+)$/.exec(location.hash);
    if (!found) return false;
    stop();
    show(+found[1]);
    document.getElementById("pictures-and-confidence").scrollIntoView();
    return true;
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest && event.target.closest('a[href^="#frame="]');
    if (link && link.getAttribute("href") === location.hash) fromAddress();
  });
  window.addEventListener("hashchange", fromAddress);
  if (!fromAddress()) show(frames[0]);
})();

"use strict";
// Draws walkers and the shadows beside them, and obeys the controls. Who gives a panel another run
// draws it by `gait.draw()`.
const gait = (() => {
  const data = JSON.parse(document.getElementById("gait-data").textContent);
  const play = document.getElementById("play");
  const slider = document.getElementById("cycle");
  const speed = document.getElementById("speed");
  const SVG = "http://www.w3.org/2000/svg";
  const END = 0.99999; // the end of a cycle, not yet the beginning of the next one

  let at = 0; // strides since the beginning
  let playing = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  let last = null; // time of the frame before [ms]

  const mix = (a, b, share) => a + share * (b - a);

  const colours = data.colours.map((text) =>
    [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16)));

  function colour(activation) {
    const place = Math.min(Math.max(activation, 0), 1) * (colours.length - 1);
    const lower = Math.min(Math.floor(place), colours.length - 2);
    const [a, b] = [colours[lower], colours[lower + 1]];
    return `rgb(${a.map((value, i) => Math.round(mix(value, b[i], place - lower))).join(" ")})`;
  }

  const path = (corners, closed) =>
    "M" + corners.map(([x, z]) => `${x.toFixed(4)} ${z.toFixed(4)}`).join("L") + (closed ? "Z" : "");

  // Corners given as [share of the way, distance to its left], placed between two points.
  function placed(outline, [ax, az], [bx, bz]) {
    const [wx, wz] = [bx - ax, bz - az];
    const length = Math.hypot(wx, wz);
    return outline.map(([u, d]) => [ax + u * wx - (d * wz) / length, az + u * wz + (d * wx) / length]);
  }

  class Panel {
    constructor(run, svg, now) {
      this.run = run;
      this.shapes = [...svg.querySelectorAll(".shape")];
      this.arrows = [...svg.querySelectorAll(".arrow")];
      this.shadows = [...svg.querySelectorAll(".shadow")];
      this.marks = svg.querySelector(".marks");
      this.labels = Array.from({ length: Math.ceil(4 * data.half_width) + 1 }, () => {
        const label = document.createElementNS(SVG, "text");
        label.setAttribute("y", "8");
        return svg.querySelector(".labels").appendChild(label);
      });
      [this.phase, this.time, this.percent] =
        ["phase", "time", "percent"].map((name) => now.querySelector(`.${name}`));
    }

    draw() {
      const { run } = this;
      const cycle = at - Math.floor(at);
      const count = run.phases.length;
      const i = Math.min(Math.floor(cycle * count), count - 1);
      const next = (i + 1) % count;
      const ahead = next === 0 ? run.distance : 0; // the next stride is one distance further on
      const share = cycle * count - i;
      const eye = run.middle + cycle * run.distance;
      const between = ([ax, az], [bx, bz]) =>
        [mix(ax, bx + ahead, share) - eye, mix(az, bz, share)];

      const points = {};
      for (const [name, values] of Object.entries(run.points)) {
        points[name] = between(values[i], values[next]);
      }
      run.shapes.forEach((shape, k) => {
        const corners = placed(shape.outline, points[shape.from], points[shape.to]);
        this.shapes[k].setAttribute("d", path(corners, shape.closed));
        if (shape.generator !== null) {
          const [a, b] = [run.activation[i], run.activation[next]];
          this.shapes[k].setAttribute("fill", colour(mix(a[shape.generator], b[shape.generator], share)));
        }
      });
      run.arrows.forEach((arrows, k) => {
        const here = arrows[i];
        const there = run.phases[i] === run.phases[next] && arrows[next]; // forces jump
        const corners = here && here.map((corner, j) =>
          there ? between(corner, there[j]) : [corner[0] - eye, corner[1]]);
        this.arrows[k].setAttribute("d", corners ? path(corners, true) : "");
      });
      this.drawShadow(cycle);
      this.drawGround(eye + Math.floor(at) * run.distance);
      this.phase.textContent = run.phases[i];
      this.time.textContent = `${(cycle * run.duration).toFixed(2)} s`;
      this.percent.textContent = `${(100 * cycle).toFixed(0)} % of right gait cycle`;
    }

    // Another stride as lines, at the same share of its own cycle: right and middle, then left.
    drawShadow(cycle) {
      const { shadow } = this.run;
      const drawn = ["", ""];
      for (const { left, names } of shadow ? shadow.chains : []) {
        const corners = names.map((name) => {
          const xz = shadow.points[name];
          const i = Math.min(Math.floor(cycle * xz.length), xz.length - 1);
          const next = (i + 1) % xz.length;
          const share = cycle * xz.length - i;
          const ahead = next === 0 ? shadow.distance : 0;
          const eye = shadow.middle + cycle * shadow.distance;
          return xz[i] && xz[next] &&
            [mix(xz[i][0], xz[next][0] + ahead, share) - eye, mix(xz[i][1], xz[next][1], share)];
        });
        if (corners.every(Boolean)) drawn[left ? 1 : 0] += path(corners, false);
      }
      this.shadows.forEach((line, k) => line.setAttribute("d", drawn[k]));
    }

    // A mark every 0.1 m, longer and with its distance every 0.5 m.
    drawGround(eye) {
      const edge = data.half_width;
      const first = Math.ceil((eye - edge) * 10);
      let marks = "";
      let used = 0;
      for (let k = first; k / 10 <= eye + edge; k += 1) {
        const x = k / 10 - eye;
        marks += `M${x.toFixed(4)} 0v${k % 5 ? -0.015 : -0.035}`;
        if (k % 5 === 0 && Math.abs(x) < edge - 0.04) {
          const label = this.labels[used];
          label.setAttribute("x", (100 * x).toFixed(2));
          label.textContent = `${(k / 10).toFixed(1)} m`;
          used += 1;
        }
      }
      this.labels.slice(used).forEach((label) => { label.textContent = ""; });
      this.marks.setAttribute("d", marks);
    }
  }

  const panels = [...document.querySelectorAll("svg.walker")].map((svg, k) =>
    new Panel(data.runs[k], svg, svg.parentElement.querySelector(".now")));

  // The video follows the walkers: it plays on its own, and is set right where it has strayed.
  const video = document.getElementById("video");
  const STRAYED = 0.1; // [s]
  function follow() {
    if (!video || !(video.duration > 0)) return;
    const { start, stride } = data.video;
    const wanted = start + at * stride;
    if (wanted > video.duration) { at = 0; return; }
    video.playbackRate = Math.min(Math.max((Number(speed.value) * stride) / data.runs[0].duration, 0.07), 10);
    if (playing === video.paused) { if (playing) video.play(); else video.pause(); }
    if (Math.abs(video.currentTime - wanted) > (playing ? STRAYED : 0.001)) video.currentTime = wanted;
  }
  video?.addEventListener("error", () => { document.getElementById("no-video").hidden = false; });
  video?.addEventListener("loadedmetadata", follow);

  function draw() {
    follow();
    panels.forEach((panel) => panel.draw());
    const percent = 100 * (at - Math.floor(at));
    slider.value = percent;
    slider.setAttribute("aria-valuetext",
      `${percent.toFixed(0)} % of the right gait cycle, ${panels[0].phase.textContent}`);
  }

  function tick(now) {
    if (!playing) return;
    if (last !== null) {
      const passed = Math.min((now - last) / 1000, 0.1); // a hidden page does not jump
      at += (passed * Number(speed.value)) / data.runs[0].duration;
      draw();
    }
    last = now;
    requestAnimationFrame(tick);
  }

  function setPlaying(wanted) {
    const starts = wanted && !playing;
    playing = wanted;
    play.textContent = playing ? "Pause" : "Play";
    last = null;
    if (starts) requestAnimationFrame(tick);
  }

  // Pauses and moves to a position; before the beginning of a stride lies the end of the one before.
  function moveTo(position) {
    setPlaying(false);
    at = position < 0 ? position + 1 : position;
    draw();
  }

  function changeSpeed(step) {
    const index = speed.selectedIndex + step;
    if (index >= 0 && index < speed.options.length) speed.selectedIndex = index;
  }

  const keys = {
    " ": () => setPlaying(!playing),
    ArrowLeft: () => moveTo(at - 0.01),
    ArrowRight: () => moveTo(at + 0.01),
    Home: () => moveTo(0),
    End: () => moveTo(Math.floor(at) + END),
    "+": () => changeSpeed(-1),
    "-": () => changeSpeed(1),
  };

  document.addEventListener("keydown", (event) => {
    const own = event.target === speed || (event.target === play && event.key === " ");
    if (own || event.ctrlKey || event.altKey || event.metaKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  play.addEventListener("click", () => setPlaying(!playing));
  slider.addEventListener("input", () =>
    moveTo(Math.floor(at) + Math.min(Number(slider.value) / 100, END)));

  const starts = playing;
  playing = false;
  draw();
  setPlaying(starts);
  return { panels, draw };
})();

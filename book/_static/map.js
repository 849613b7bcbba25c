// The first page's map: the same sweeps, drawn at three sets of poses and at what lies between; a
// click on its path puts that step into the toy above. Chapters 5 and 10 begin with the first two
// sets. killian_map.py writes the data; without it, without JavaScript and on paper stands a
// picture.
(() => {
  const vendor = new URL("vendor/killian/map.js", document.currentScript.src).href;
  const MARGIN_M = 12; // m of the map about the path
  const PLAY_MS = 7000;
  const STATE_WORDS = ["wheels", "scan matching", "places recognised"];
  const SCALE_BAR_M = 50; // m
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

  // Poses as steps, each seen from the pose before: between two sets of poses the path unfolds.
  const stepsOf = (poses) => {
    const steps = new Float64Array(poses.length);
    for (let k = 3; k < poses.length; k += 3) {
      const c = Math.cos(poses[k - 1]);
      const s = Math.sin(poses[k - 1]);
      const dx = poses[k] - poses[k - 3];
      const dy = poses[k + 1] - poses[k - 2];
      const turn = poses[k + 2] - poses[k - 1];
      steps.set([c * dx + s * dy, c * dy - s * dx, Math.atan2(Math.sin(turn), Math.cos(turn))], k);
    }
    steps.set(poses.subarray(0, 3));
    return steps;
  };

  // Where the drive starts and ends, and how long 50 m are.
  const label = (context, dense, [start, end], bar) => {
    const write = (text, left, top) => {
      context.strokeText(text, left, top);
      return context.fillText(text, left, top);
    };
    const { width, height } = context.canvas;
    const isClosed = Math.hypot(start[0] - end[0], start[1] - end[1]) < 12 * dense;
    context.font = `600 ${13 * dense}px ${getComputedStyle(context.canvas).fontFamily}`;
    Object.assign(context, {
      fillStyle: "white",
      strokeStyle: "#0f151c",
      lineWidth: 4 * dense,
      lineJoin: "round",
    });
    const names =
      width < 480 * dense
        ? [
            [end, ""],
            [start, ""],
          ]
        : isClosed
          ? [[end, "start and end"]]
          : [
              [start, "start"],
              [end, "end"],
            ]; // no room for words on a telephone
    for (const [[left, top], text] of names) {
      context.beginPath();
      context.arc(left, top, 4.5 * dense, 0, 2 * Math.PI);
      context.stroke();
      context.fill();
      if (!text) continue;
      const labelWidth = context.measureText(text).width;
      const isAtEdge = left + labelWidth + 20 * dense > width;
      write(
        text,
        isAtEdge ? left - labelWidth - 9 * dense : left + 9 * dense,
        top + (text === "end" ? 17 : -7) * dense,
      );
    }
    context.fillRect(16 * dense, height - 12 * dense, bar, 2 * dense);
    write(`${SCALE_BAR_M} m`, 16 * dense, height - 18 * dense);
  };

  // The two sweeps of a step, for the toy above: ranges in cm.
  const FIRST_GUESS_M_RAD = [1.0, -0.6, 0.3]; // m, rad: where the newer sweep lies first
  const pack = (numbers) =>
    btoa(String.fromCharCode(...new Uint8Array(Float64Array.from(numbers).buffer)));
  const sceneOf = ({ scans, lied, ranges, motions }, i) => {
    const all = new Uint16Array(bytes(ranges).buffer);
    const k = scans[i];
    const beams = all.length / scans.length / 2;
    const [target, source] = [2 * i, 2 * i + 1].map((row) =>
      [...all.subarray(beams * row, beams * (row + 1))].flatMap((range, j) => {
        const angle = (j / beams - 0.5) * Math.PI;
        return range ? [(range / 100) * Math.cos(angle), (range / 100) * Math.sin(angle)] : [];
      }),
    );
    const hint = `Step ${k}: ${lied[k] ?? "drag the newer scan, blue, onto the older one."}`;
    return {
      name: `step ${k}`,
      source: pack(source),
      target: pack(target),
      normals: pack(target.map(() => NaN)),
      guess: lied[k] ? [0, 0, 0] : FIRST_GUESS_M_RAD,
      answer: motions[i],
      hint,
    };
  };
  const intoToy = async (scene) => {
    await window.drawWidgets();
    const toy = document.querySelector(".icp-by-hand");
    toy.dispatchEvent(new CustomEvent("icp-scene", { detail: scene }));
    toy.scrollIntoView({ block: "center" });
    toy.querySelector(".icp-plane").focus({ preventScroll: true });
  };

  const enliven = (
    figure,
    { beams, reach, ranges, states, every, total, turn: along, steps: tries },
  ) => {
    const rangeBytes = bytes(ranges);
    const steps = states.map(({ poses }) => stepsOf(new Float32Array(bytes(poses).buffer)));
    const count = steps[0].length / 3;
    const path = new Float64Array(3 * count);
    const rays = Array.from({ length: beams }, (_, j) => (j / beams - 0.5) * Math.PI).map((a) => [
      Math.cos(a),
      Math.sin(a),
    ]);
    const canvas = make("canvas", { role: "img" });
    const name = make("b", {});
    const errorNode = make("span", {});
    const isFirst = figure.matches(".killian-map");
    const lastState = isFirst ? 2 : 1;
    const slider = make("input", { type: "range", min: 0, max: lastState, step: 0.01 });
    slider.setAttribute("aria-label", "Poses from");
    const play = make("button", { type: "button", textContent: "▶", title: "Play" });
    play.setAttribute("aria-label", "Play");
    const bar = make(
      "div",
      { className: "map-bar" },
      play,
      make("span", {}, STATE_WORDS[0]),
      slider,
      make("span", {}, STATE_WORDS[lastState]),
    );
    // Above the figure of a chapter, which compares with the reference, room is kept for it.
    const live = document.querySelector(".map-live") ?? make("div", { className: "map-live" });
    live.append(make("p", {}, name, errorNode), canvas, bar);
    if (isFirst) figure.prepend(live);
    const give = (i) => intoToy(sceneOf(tries, i));
    const spots = [];
    if (isFirst) {
      const lied = Object.keys(tries.lied).map((k) =>
        make("button", {
          type: "button",
          textContent: k,
          onclick: () => give(tries.scans.indexOf(Number(k))),
        }),
      );
      live.append(
        make(
          "div",
          { className: "map-bar" },
          "Click on a dot to try that step above. At four of them ICP was wrong:",
          ...lied,
        ),
      );
      canvas.addEventListener("click", ({ offsetX, offsetY }) => {
        const distances = spots.map(([u, v]) => Math.hypot(u - offsetX, v - offsetY));
        give(distances.indexOf(Math.min(...distances)));
      });
      document.addEventListener("icp-found", ({ target }) => {
        if (target.querySelector(".map-next")) return;
        const next = make("button", {
          type: "button",
          className: "map-next",
          textContent: `Now ${total.toLocaleString("en")} times`,
        });
        next.addEventListener("click", () => {
          figure.scrollIntoView({ block: "center" });
          return start();
        });
        target.querySelector(".icp-row").append(next);
      });
    }

    const walk = (at) => {
      const i = Math.min(1, Math.floor(at));
      const w = at - i;
      const [a, b] = [steps[i], steps[i + 1]];
      let [x, y] = a;
      let turn = a[2] + (isFirst ? along : -Math.PI / 2);
      let low = [x, y];
      let high = [x, y];
      for (let k = 0; k < 3 * count; k += 3) {
        if (k) {
          const [dx, dy, dt] = [0, 1, 2].map((n) => a[k + n] + w * (b[k + n] - a[k + n]));
          const c = Math.cos(turn);
          const s = Math.sin(turn);
          x += c * dx - s * dy;
          y += s * dx + c * dy;
          turn += dt;
        }
        path[k] = x;
        path[k + 1] = y;
        path[k + 2] = turn;
        low = [Math.min(low[0], x), Math.min(low[1], y)];
        high = [Math.max(high[0], x), Math.max(high[1], y)];
      }
      return { low, high };
    };

    const draw = () => {
      const at = slider.valueAsNumber;
      const { low, high } = walk(at);
      const poseSet = states[Math.round(at)];
      const width = canvas.clientWidth;
      const dense = Math.min(2, devicePixelRatio || 1);
      if (!width) return;
      const W = (canvas.width = Math.round(width * dense));
      const H = (canvas.height = Math.round(canvas.clientHeight * dense));
      const scale = Math.min(
        W / (high[1] - low[1] + 2 * MARGIN_M),
        H / (high[0] - low[0] + 2 * MARGIN_M),
      );
      const cx = (low[0] + high[0]) / 2;
      const cy = (low[1] + high[1]) / 2;
      const context = canvas.getContext("2d");
      const image = context.createImageData(W, H);
      const pixels = image.data;
      const u = (y) => W / 2 - (y - cy) * scale;
      const v = (x) => H / 2 - (x - cx) * scale;
      for (let k = 0; k < count; k++) {
        const [x, y, turn] = path.subarray(3 * k, 3 * k + 3);
        const c = Math.cos(turn);
        const s = Math.sin(turn);
        for (let j = 0; j < beams; j++) {
          const r = (rangeBytes[beams * k + j] * reach) / 255;
          if (!r) continue;
          const [p, q] = rays[j];
          const left = u(y + r * (s * p + c * q)) | 0;
          const top = v(x + r * (c * p - s * q)) | 0;
          if (left < 0 || top < 0 || left > W - 2 || top > H - 2) continue;
          for (const o of [
            4 * (top * W + left),
            4 * (top * W + left + 1),
            4 * (top * W + W + left),
          ]) {
            pixels[o] = pixels[o + 1] = pixels[o + 2] = 255;
            pixels[o + 3] = Math.min(255, pixels[o + 3] + 60);
          }
        }
      }
      context.putImageData(image, 0, 0);
      context.strokeStyle = getComputedStyle(live).getPropertyValue("--path");
      context.lineWidth = 1.4 * dense;
      context.beginPath();
      for (let k = 0; k < 3 * count; k += 3) context.lineTo(u(path[k + 1]), v(path[k]));
      context.stroke();
      if (isFirst)
        tries.scans.forEach((k, i) => {
          const n = 3 * Math.min(count - 1, Math.round(k / every));
          const [left, top] = [u(path[n + 1]), v(path[n])];
          const isLie = k in tries.lied;
          spots[i] = [left / dense, top / dense];
          context.beginPath();
          context.arc(left, top, (isLie ? 6 : 3) * dense, 0, 2 * Math.PI);
          Object.assign(context, {
            fillStyle: "white",
            strokeStyle: "#e69f00",
            lineWidth: 2.5 * dense,
          });
          if (isLie) context.stroke();
          else context.fill();
        });
      label(
        context,
        dense,
        [0, 3 * count - 3].map((k) => [u(path[k + 1]), v(path[k])]),
        SCALE_BAR_M * scale,
      );
      name.textContent = poseSet.name;
      const metres = poseSet.off < 10 ? poseSet.off.toFixed(1) : Math.round(poseSet.off);
      errorNode.textContent = `${metres} m off, in the median`;
      slider.setAttribute("aria-valuetext", `${poseSet.name}: ${errorNode.textContent}`);
      canvas.setAttribute(
        "aria-label",
        `Map of the corridors and the path. ${poseSet.name}: ${errorNode.textContent}.`,
      );
    };

    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    let playing = null;
    const stop = () => {
      cancelAnimationFrame(playing);
      return (playing = null);
    };
    const start = () => {
      stop();
      let lastFrameTime = performance.now();
      let at = still ? lastState : slider.valueAsNumber % lastState;
      const go = (now) => {
        at = Math.min(lastState, at + (2 * (now - lastFrameTime)) / PLAY_MS);
        lastFrameTime = now;
        slider.value = at;
        draw();
        playing = at < lastState ? requestAnimationFrame(go) : null;
      };
      playing = requestAnimationFrame(go);
    };
    slider.addEventListener("input", () => {
      stop();
      return draw();
    });
    play.addEventListener("click", () => (playing ? stop() : start()));
    new ResizeObserver(draw).observe(canvas);
    slider.value = still ? lastState : 0;
    draw();
    if (still) return;
    const once = new IntersectionObserver(
      ([{ isIntersecting }]) => {
        if (!isIntersecting) return;
        once.disconnect();
        start();
      },
      { threshold: 0.7 },
    );
    once.observe(canvas);
  };

  document.addEventListener("DOMContentLoaded", () => {
    const figure =
      document.querySelector("figure.killian-map") ??
      document.querySelector("img[src*='killian-map']")?.closest("figure");
    if (!figure) return;
    window.killianMap = (data) => enliven(figure, data);
    document.head.append(make("script", { src: vendor }));
  });
})();

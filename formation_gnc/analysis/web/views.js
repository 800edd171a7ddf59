// What the two views of a replay show, and the controls of its time.
"use strict";

const circleAround = (a, b, radius, from = 0, to = 2 * Math.PI) =>
  Array.from({ length: CIRCLE + 1 }, (_, k) => from + ((to - from) * k) / CIRCLE).map((angle) =>
    plus(scaled(a, radius * Math.cos(angle)), scaled(b, radius * Math.sin(angle))));

/** Meridians and parallels of the Earth every 30 deg, turned by an angle. */
function graticule(radius, turn) {
  const lines = [], degree = Math.PI / 180;
  for (let k = 0; k < 12; k += 1) {
    const angle = turn + 30 * degree * k;
    lines.push(circleAround([Math.cos(angle), Math.sin(angle), 0], [0, 0, 1], radius, -Math.PI / 2, Math.PI / 2));
  }
  for (let latitude = -60; latitude <= 60; latitude += 30) {
    const [wide, high] = [radius * Math.cos(latitude * degree), radius * Math.sin(latitude * degree)];
    lines.push(circleAround([1, 0, 0], [0, 1, 0], wide).map((each) => plus(each, [0, 0, high])));
  }
  return lines;
}

/** Night side of the Earth: half of the terminator, closed along the limb. */
function night(view, palette, radius, sun) {
  const s = [dot(sun, view.right), dot(sun, view.up), dot(sun, view.near)];
  const flat = Math.hypot(s[0], s[1]);
  if (flat < 1e-6) return "";
  const u = [-s[1] / flat, s[0] / flat, 0];
  let w = cross(s, u);
  if (w[2] < 0) w = scaled(w, -1);
  const away = [-s[0] / flat, -s[1] / flat, 0];
  const edge = [...circleAround(u, w, radius, 0, Math.PI), ...circleAround(scaled(u, -1), away, radius, 0, Math.PI)];
  const [x, y] = view.place([0, 0, 0]);
  const points = edge.map((p) => `${(x + view.scale * p[0]).toFixed(1)},${(y - view.scale * p[1]).toFixed(1)}`);
  return `<polygon points="${points.join(" ")}" fill="${palette.night}" opacity="0.55"/>`;
}

/** The Earth with the satellites; the formation is drawn enlarged, or it would be one point. */
function paintEarth(replay, view, palette) {
  const { earth } = replay, time = replay.time, frame = replay.frame(time);
  const [x, y] = view.place([0, 0, 0]), size = view.scale * earth.radius;
  const isSeen = (point) => {
    const [px, py, depth] = view.place(point);
    return depth > 0 || Math.hypot(px - x, py - y) > size;
  };
  const [across, up] = [dot(earth.sun, view.right), dot(earth.sun, view.up)].map((each) => 40 * each);
  let drawing = `<defs><radialGradient id="ball" cx="${50 + across}%" cy="${50 - up}%" r="85%"><stop offset="0" stop-color="${palette.bright}"/>` +
    `<stop offset="1" stop-color="${palette.ocean}"/></radialGradient></defs>`;
  const orbit = (from, to, look) => {
    const points = replay.path(replay.chief, from, to, replay.fine), seen = points.map(isSeen);
    const places = points.map((each) => view.place(each));
    return [false, true].map((front) =>
      line(places, `${look} ${front ? "" : 'opacity="0.3" stroke-dasharray="3 4"'}`, (k) => seen[k] === front));
  };
  const [behind, before] = orbit(time, time + replay.period, `stroke="${palette.soft}" stroke-width="1"`);
  const [trailBehind, trail] = orbit(time - TRAIL * replay.period, time, 'stroke="#e8862e" stroke-width="2.2"');
  drawing += `<circle cx="${x}" cy="${y}" r="${1.025 * size}" fill="${palette.rim}" opacity="0.22"/>`;
  drawing += `<circle cx="${x}" cy="${y}" r="${size}" fill="url(#ball)" stroke="${palette.rim}"/>`;
  const turned = graticule(earth.radius, earth.angle + earth.rate * (time - replay.begin));
  for (const each of turned) {
    const places = each.map((point) => view.place(point));
    drawing += line(places, `stroke="${palette.land}" stroke-width="0.8" opacity="0.6"`, (k) => places[k][2] > 0);
  }
  drawing += night(view, palette, earth.radius, earth.sun) + behind + trailBehind + before + trail;
  const chief = replay.position(replay.chief, frame), velocity = replay.linear(replay.chief, 6, frame).slice(3);
  const radial = unit(chief), normal = unit(cross(chief, velocity)), along = cross(normal, radial);
  const satellites = replay.deputies.map((deputy) => {
    const [r, a, n] = scaled(replay.position(deputy.state, frame), replay.enlarged);
    return [deputy.name, deputy.colour, plus(chief, plus(scaled(radial, r), plus(scaled(along, a), scaled(normal, n))))];
  });
  for (const [name, colour, point] of [["chief", palette.ink, chief], ...satellites]) {
    const [px, py] = view.place(point);
    if (!isPoint([px, py])) continue;
    const look = isSeen(point) ? "" : 'opacity="0.35"';
    drawing += `<circle data-satellite="${escapeText(name)}" cx="${px.toFixed(2)}" cy="${py.toFixed(2)}" r="4" ${look} ` +
      `fill="${colour[0] === "#" ? shade(colour, palette) : colour}" stroke="${palette.paper}"><title>${escapeText(name)}</title></circle>`;
  }
  const height = quantity(Math.hypot(...chief) - earth.radius, LENGTHS);
  return [drawing, `Inertial frame; chief at ${height} above the equatorial radius.` +
    (replay.deputies.length ? ` The formation is drawn ${replay.enlarged.toLocaleString("en")} times its size.` : "") +
    (earth.dated ? "" : " The run's date is not in the bag: the Sun and Greenwich stand as at J2000.0.")];
}

/** Grid in the orbital plane, and arrows along the Hill axes from the chief. */
function ground(view, palette, step, reach) {
  let drawing = "";
  const count = Math.ceil(reach / step), span = count * step;
  const middle = [0, 1].map((k) => Math.round(view.centre[k] / step) * step);
  for (let k = -count; k <= count; k += 1)
    for (const [a, b] of [[0, 1], [1, 0]]) {
      const ends = [-span, span].map((end) => {
        const point = [0, 0, 0];
        point[a] = middle[a] + k * step;
        point[b] = middle[b] + end;
        return view.place(point);
      });
      drawing += line(ends, `stroke="${palette.grid}" stroke-width="${k === 0 ? 1.4 : 0.8}"`);
    }
  const origin = view.place([0, 0, 0]);
  ["radial", "along-track", "cross-track"].forEach((name, k) => {
    const tip = view.place([0, 1, 2].map((each) => (each === k ? step : 0)));
    drawing += arrow(origin, tip, palette.soft) + words(tip[0] + 3, tip[1] - 5, name, palette.soft, 11);
  });
  return drawing;
}

/** Outline of an ellipsoid of three standard deviations around a point. */
function ellipsoid(view, place, covariance, colour) {
  const [xx, xy, xz, yy, yz, zz] = covariance;
  const times = (v) => [xx * v[0] + xy * v[1] + xz * v[2], xy * v[0] + yy * v[1] + yz * v[2], xz * v[0] + yz * v[1] + zz * v[2]];
  const [a, b, c] = [dot(view.right, times(view.right)), dot(view.right, times(view.up)), dot(view.up, times(view.up))];
  const [mean, swing] = [(a + c) / 2, Math.hypot((a - c) / 2, b)];
  const radii = [mean + swing, mean - swing].map((each) => 3 * view.scale * Math.sqrt(Math.max(each, 0)));
  if (!isPoint([...place, ...radii]) || radii[0] > 1e5) return "";
  const turn = (-90 * Math.atan2(2 * b, a - c)) / Math.PI;
  return `<ellipse data-ellipsoid="" rx="${radii[0].toFixed(2)}" ry="${radii[1].toFixed(2)}" fill="${colour}" fill-opacity="0.18" stroke="${colour}" ` +
    `stroke-width="0.8" transform="translate(${place[0].toFixed(2)} ${place[1].toFixed(2)}) rotate(${turn.toFixed(2)})"/>`;
}

function arrow(from, to, colour) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]], length = Math.hypot(dx, dy);
  if (!isPoint([...from, ...to]) || length < 1.5) return "";
  const [ux, uy] = [dx / length, dy / length], head = Math.min(7, length / 2);
  const side = (sign) => [to[0] - head * ux + sign * 0.5 * head * uy, to[1] - head * uy - sign * 0.5 * head * ux];
  return `<g>${line([from, to], `stroke="${colour}" stroke-width="2"`)}${line([side(1), to, side(-1)], `stroke="${colour}" stroke-width="2"`)}</g>`;
}

/** What stands still in the Hill view: grid, axes, whole paths. */
function paintPaths(replay, view, palette) {
  let drawing = ground(view, palette, replay.step, replay.reach);
  for (const deputy of replay.deputies) {
    const colour = shade(deputy.colour, palette);
    const path = replay.path(deputy.state, replay.begin, replay.end, replay.coarse).map((each) => view.place(each));
    const target = replay.path(deputy.target, replay.begin, replay.end).map((each) => view.place(each));
    drawing += line(target, `stroke="${colour}" stroke-width="1" stroke-dasharray="2 4" opacity="0.7"`);
    drawing += line(path, `stroke="${colour}" stroke-width="1" opacity="0.35"`);
  }
  return drawing;
}

/** One deputy at a time: keep-out sphere, covariance, trail, target, thrust, and itself. */
function paintDeputy(replay, view, palette, deputy, frame) {
  const colour = shade(deputy.colour, palette), name = escapeText(deputy.name), at = replay.position(deputy.state, frame);
  const place = view.place(at), error = replay.linear(deputy.error, 3, frame);
  if (!isPoint(place)) return "";
  let drawing = "";
  const [x, y] = place.map((each) => each.toFixed(2));
  if (deputy.keep_out > 0)
    drawing += `<circle data-keep-out="" cx="${x}" cy="${y}" r="${(view.scale * deputy.keep_out).toFixed(1)}" fill="#d62728" ` +
      'fill-opacity="0.06" stroke="#d62728" stroke-dasharray="4 3" stroke-width="0.9"/>';
  drawing += ellipsoid(view, view.place(plus(at, error)), replay.linear(deputy.covariance, 6, frame), colour);
  const trail = replay.path(deputy.state, replay.time - TRAIL * replay.period, replay.time, replay.fine);
  drawing += line(trail.map((each) => view.place(each)), `stroke="${colour}" stroke-width="2.2" opacity="0.9"`);
  const [tx, ty] = view.place(replay.position(deputy.target, frame));
  if (isPoint([tx, ty]))
    drawing += `<path data-target="" d="M${tx.toFixed(1)} ${(ty - 6).toFixed(1)}l6 6l-6 6l-6 -6z" fill="none" stroke="${colour}" stroke-width="1.6"/>`;
  const thrust = [0, 1, 2].map((k) => deputy.thrust[3 * frame.high + k]), size = Math.hypot(...thrust);
  if (size > 0 && replay.strongest > 0) {
    const length = (0.28 * replay.reach * Math.sqrt(size / replay.strongest)) / view.zoom / size;
    drawing += `<g data-thrust="">${arrow(place, view.place(plus(at, scaled(thrust, length))), "#e8862e")}</g>`;
  }
  return `${drawing}<circle data-satellite="${name}" cx="${x}" cy="${y}" r="5" fill="${colour}" stroke="${palette.paper}"><title>${name}</title></circle>` +
    words(place[0] + 8, place[1] - 8, deputy.name.length > 24 ? `${deputy.name.slice(0, 23)}…` : deputy.name, palette.ink);
}

/** The formation in the Hill frame. */
function paintHill(replay, view, palette) {
  const frame = replay.frame(replay.time);
  const focus = replay.deputies.find((each) => each.name === view.root.querySelector("select").value);
  view.centre = focus ? replay.position(focus.state, frame) : replay.middle;
  if (!isPoint(view.centre)) view.centre = replay.middle;
  const key = JSON.stringify([view.azimuth, view.elevation, view.zoom, view.width, view.height, view.centre, palette.paper]);
  if (view.key !== key) [view.key, view.still] = [key, paintPaths(replay, view, palette)];
  const [x, y] = view.place([0, 0, 0]);
  let drawing = `${view.still}<circle cx="${x}" cy="${y}" r="4.5" fill="${palette.ink}"/>${words(x + 8, y + 14, "chief", palette.ink)}`;
  const depth = (deputy) => view.place(replay.position(deputy.state, frame))[2];
  for (const deputy of [...replay.deputies].sort((a, b) => depth(a) - depth(b)))
    drawing += paintDeputy(replay, view, palette, deputy, frame);
  const keep = replay.deputies.some((each) => each.keep_out > 0) ? " Dashed spheres: least separation." : "";
  const push = replay.strongest > 0
    ? ` Arrows: acceleration by thrust, mean since the frame before, length by its root; longest ${quantity(replay.strongest, ACCELERATIONS)}.` : "";
  return [drawing, `Hill frame, grid ${quantity(replay.step, LENGTHS)}. Diamonds: targets. Ellipsoids: 3σ of the filter.${push}${keep}`];
}

/** Extent of the formation, and what is drawn with it in proportion. */
function measure(replay) {
  const low = [0, 0, 0], high = [0, 0, 0];
  let far = 0, strongest = 0;
  for (const { state, target, thrust } of replay.deputies) {
    for (const column of [state, target])
      for (let row = 0; row < column.length; row += 6)
        for (let k = 0; k < 3; k += 1)
          if (Math.abs(column[row + k]) < 1e15) {
            low[k] = Math.min(low[k], column[row + k]);
            high[k] = Math.max(high[k], column[row + k]);
            far = Math.max(far, Math.abs(column[row + k]));
          }
    for (let row = 0; row < thrust.length; row += 3) {
      const size = Math.hypot(thrust[row], thrust[row + 1], thrust[row + 2]);
      if (size < 1e15) strongest = Math.max(strongest, size);
    }
  }
  replay.middle = low.map((each, k) => (each + high[k]) / 2);
  replay.reach = Math.max(Math.hypot(...low.map((each, k) => high[k] - each)) / 2, 0.1);
  replay.step = nice(replay.reach / 4);
  replay.corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [0, 1, 2].map((k) => ((n >> k) & 1 ? high[k] : low[k])));
  replay.strongest = strongest;
  replay.enlarged = far > 0 ? Math.max(1, nice((0.2 * replay.earth.radius) / far)) : 1;
  replay.fine = Math.min(16, Math.max(1, Math.ceil((90 * replay.usual) / replay.period)));
  replay.coarse = Math.max(1, Math.min(replay.fine, Math.floor(8000 / replay.times.length / replay.deputies.length)));
  replay.furthest = replay.earth.radius;
  for (let row = 0; row < replay.chief.length; row += 6) {
    const radius = Math.hypot(replay.chief[row], replay.chief[row + 1], replay.chief[row + 2]);
    if (radius < 1e12) replay.furthest = Math.max(replay.furthest, radius);
  }
}

/** Azimuth from which the orbit is open, with the day rather than the night. */
function sideOf(replay, elevation) {
  const start = Array.from(replay.chief.slice(0, 6));
  const normal = unit(cross(start.slice(0, 3), start.slice(3)));
  const rating = (azimuth) => {
    const near = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
    return 0.15 * dot(near, replay.earth.sun) - Math.abs(Math.abs(dot(near, normal)) - 0.45);
  };
  const sides = Array.from({ length: 36 }, (_, k) => (Math.PI * k) / 18);
  return isPoint(normal) ? sides.reduce((best, each) => (rating(each) > rating(best) ? each : best)) : 0;
}

/** Events and eclipses over the slider. */
function drawTrack(replay, svg) {
  const span = replay.end - replay.begin || 1, percent = (time) => (100 * (time - replay.begin)) / span;
  let drawing = "";
  for (const [name, from, to] of replay.eclipses)
    drawing += `<rect x="${percent(from)}%" width="${percent(to) - percent(from)}%" y="4" height="8" fill="#888" opacity="0.3" data-at="${from}"><title>eclipse of ${escapeText(name)}</title></rect>`;
  for (const { time, text, colour } of replay.events)
    drawing += `<rect x="${percent(time)}%" width="3" y="0" height="12" fill="${colour}" data-at="${time}"><title>${escapeText(text)}</title></rect>`;
  svg.innerHTML = drawing;
  svg.addEventListener("click", (event) => {
    if ("at" in event.target.dataset) page.setTime(Number(event.target.dataset.at));
  });
}

function startControls(replay, root) {
  const find = (selector) => root.querySelector(selector);
  const slider = find("input"), button = find("button"), speed = find("select"), output = find("output");
  Object.assign(slider, { min: replay.begin, max: replay.end, step: "any" });
  let playing = null;
  const stop = () => {
    cancelAnimationFrame(playing);
    playing = null;
    button.textContent = "▶ play";
  };
  const run = (before) => (now) => {
    const time = replay.time + ((now - before) / 1000) * Number(speed.value) * ((replay.end - replay.begin) / 40);
    page.setTime(Math.min(time, replay.end));
    if (time >= replay.end) stop(); else playing = requestAnimationFrame(run(now));
  };
  button.addEventListener("click", () => {
    if (playing !== null) return stop();
    if (replay.time >= replay.end) page.setTime(replay.begin);
    button.textContent = "❚❚ pause";
    playing = requestAnimationFrame(run(performance.now()));
  });
  slider.addEventListener("input", () => page.setTime(Number(slider.value)));
  page.listeners.push((time) => {
    if (time === null) return;
    replay.time = Math.min(replay.end, Math.max(replay.begin, time));
    slider.value = replay.time;
    output.textContent = `${replay.time.toFixed(0)} s · orbit ${((replay.time - replay.begin) / replay.period + 1).toFixed(2)}`;
  });
  drawTrack(replay, find(".track svg"));
}

addEventListener("DOMContentLoaded", () => {
  const root = document.querySelector(".replay");
  if (!root) return;
  const replay = new Replay(JSON.parse(root.querySelector("script").textContent));
  replay.time = replay.begin;
  measure(replay);
  const [earth, hill] = [...root.querySelectorAll(".view")];
  const globe = { axes: [[0, 1, 0], [0, 0, 1], [1, 0, 0]], azimuth: 0, elevation: 0.4, reach: [replay.furthest, replay.furthest], centre: [0, 0, 0] };
  globe.azimuth = sideOf(replay, globe.elevation);
  const frame = { axes: [[0, -1, 0], [1, 0, 0], [0, 0, 1]], azimuth: -0.5, elevation: 0.35, reach: [1, 1], centre: replay.middle };
  const views = [
    new View(earth, (view, palette) => paintEarth(replay, view, palette), globe),
    new View(hill, (view, palette) => paintHill(replay, view, palette), frame),
  ];
  views[1].aim();
  const extent = (axis) => Math.max(...replay.corners.map((each) => Math.abs(dot(axis, plus(each, scaled(replay.middle, -1))))));
  const [wide, high] = [extent(views[1].right), extent(views[1].up)].map((each) => Math.max(each, 0.35 * replay.reach));
  views[1].reach = views[1].home.reach = [1.15 * wide, 1.15 * high];
  hill.querySelector("select").addEventListener("change", (event) => {
    views[1].zoom = event.target.value ? 4 : 1;
    views[1].draw();
  });
  startControls(replay, root.parentElement.querySelector(".time"));
  page.listeners.push(() => views.forEach((view) => view.draw()));
  page.setTime(replay.begin);
});

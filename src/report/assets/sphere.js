// SPDX-License-Identifier: Apache-2.0
// If Plotly is in the page, draws the readings on the unit sphere as a scene that can be turned.
'use strict';
(() => {
  if (!window.Plotly || !document.createElement('canvas').getContext('webgl')) return;
  const looks = getComputedStyle(document.documentElement);
  const colour = (name) => looks.getPropertyValue(`--${name}`).trim();

  const circles = () => {
    const line = { x: [], y: [], z: [] };
    const add = (at) => {
      for (let i = 0; i <= 48; ++i) at((i * Math.PI) / 24).forEach((value, axis) => line['xyz'[axis]].push(value));
      for (const axis of 'xyz') line[axis].push(null);
    };
    for (let k = 0; k < 6; ++k) {
      const [c, s] = [Math.cos((k * Math.PI) / 6), Math.sin((k * Math.PI) / 6)];
      if (k > 0) add((t) => [s * Math.cos(t), s * Math.sin(t), c]);
      add((t) => [Math.sin(t) * c, Math.sin(t) * s, Math.cos(t)]);
    }
    return { ...line, type: 'scatter3d', mode: 'lines', hoverinfo: 'skip', showlegend: false, line: { color: colour('frame'), width: 1 } };
  };

  const axes = () => {
    const along = (axis) => [0, 1, 2].flatMap((k) => (k === axis ? [0, 1.35, null] : [0, 0, null]));
    const text = ['', 'x', '', '', 'y', '', '', 'z', ''];
    return { x: along(0), y: along(1), z: along(2), text, type: 'scatter3d', mode: 'lines+text', hoverinfo: 'skip', showlegend: false, line: { color: colour('soft'), width: 2 }, textfont: { color: colour('ink'), size: 14 } };
  };

  // Fields of a pose: number, whether rejected, raw x, y, z and error, corrected x, y, z and error.
  const readings = ({ poses, unit }, name, first, symbol) => ({
    x: poses.map((pose) => pose[first]),
    y: poses.map((pose) => pose[first + 1]),
    z: poses.map((pose) => pose[first + 2]),
    text: poses.map((pose) => `pose ${pose[0]}, ${name}${pose[1] ? ', rejected' : ''}: error ${pose[first + 3]} ${unit}`),
    name,
    type: 'scatter3d',
    mode: 'markers',
    hoverinfo: 'text',
    marker: { size: 3.5, color: colour(name === 'raw' ? 'before' : 'after'), symbol: poses.map((pose) => (pose[1] ? 'x' : symbol)) },
  });

  const joined = ({ poses }) => {
    const line = (axis) => poses.flatMap((pose) => [pose[2 + axis], pose[6 + axis], null]);
    return { x: line(0), y: line(1), z: line(2), type: 'scatter3d', mode: 'lines', hoverinfo: 'skip', showlegend: false, line: { color: colour('before'), width: 1 } };
  };

  const draw = (place, data) => {
    const most = Math.max(1.45, 1.05 * data.reach);
    // The camera sees the full height of the sphere. If the place on the page is narrower than
    // high, the camera stands further off.
    const far = Math.max(1, place.offsetHeight / (place.offsetWidth || 1));
    const axis = { visible: false, range: [-most, most], showspikes: false };
    const layout = {
      margin: { l: 0, r: 0, t: 0, b: 0 },
      font: { color: colour('ink'), size: 12 },
      paper_bgcolor: 'rgba(0,0,0,0)',
      legend: { x: 0, y: 1, bgcolor: 'rgba(0,0,0,0)' },
      scene: { aspectmode: 'cube', xaxis: axis, yaxis: axis, zaxis: axis, camera: { eye: { x: 0.95 * far, y: 0.82 * far, z: 0.58 * far } } },
      uirevision: 'kept',
    };
    const traces = [circles(), axes(), joined(data), readings(data, 'raw', 2, 'diamond'), readings(data, 'corrected', 6, 'circle')];
    return Plotly.react(place, traces, layout, { displayModeBar: false, scrollZoom: false });
  };

  // The arrow keys turn the sphere, too: about the z axis, and up and down.
  const turn = (place, key) => {
    const { x, y, z } = place.layout.scene.camera.eye;
    const length = Math.hypot(x, y, z);
    const round = Math.atan2(y, x) + ({ ArrowLeft: -1, ArrowRight: 1 }[key] ?? 0) * 0.15;
    const up = Math.max(-1.5, Math.min(1.5, Math.asin(z / length) + ({ ArrowUp: 1, ArrowDown: -1 }[key] ?? 0) * 0.15));
    const eye = { x: length * Math.cos(up) * Math.cos(round), y: length * Math.cos(up) * Math.sin(round), z: length * Math.sin(up) };
    Plotly.relayout(place, { 'scene.camera': { eye } });
  };

  const scenes = [...document.querySelectorAll('.sphere')].map((sphere) => {
    const data = JSON.parse(sphere.querySelector('script').textContent);
    const place = document.createElement('div');
    const words = document.createElement('p');
    place.className = 'turning';
    place.tabIndex = 0;
    place.setAttribute('role', 'group');
    place.setAttribute('aria-label', `${data.sensor}, raw and corrected readings on the unit sphere; arrow keys turn it`);
    place.addEventListener('keydown', (event) => {
      if (!event.key.startsWith('Arrow')) return;
      event.preventDefault();
      turn(place, event.key);
    });
    words.className = 'words';
    words.textContent = `${data.sensor}: readings at the poses, in the body frame; without errors all would lie on the sphere. ${data.magnification > 1 ? `Errors are drawn ${data.magnification} times as large. ` : ''}Turn the sphere with the mouse or the arrow keys; a point shows its pose and error.`;
    sphere.append(place, words);
    return { sphere, place, data };
  });
  const drawAll = async () => {
    for (const { sphere, place, data } of scenes) {
      await draw(place, data);
      sphere.classList.add('drawn');
    }
  };
  drawAll();
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', drawAll);
  window.addEventListener('resize', () => {
    for (const { place } of scenes) if (place.offsetHeight > 0) Plotly.Plots.resize(place);
  });
})();

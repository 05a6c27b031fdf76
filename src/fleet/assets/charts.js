// SPDX-License-Identifier: Apache-2.0
// The common parts of all charts of the page, built on uPlot. Colours come from the style sheet;
// marks differ not only in colour but also in form.
'use strict';
(() => {
  const { text, element } = window.fleet;
  const drawn = new Map(); // By container.

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const utc = (seconds) => window.uPlot.tzDate(new Date(1000 * seconds), 'Etc/UTC');

  // The range of the drawn values with a margin.
  const rangeOf = (lists) => {
    let low = Infinity;
    let high = -Infinity;
    for (const list of lists) {
      for (const value of list) {
        if (value === null || !Number.isFinite(value)) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (low > high) return [0, 1];
    const air = 0.06 * (high - low) || 0.06 * Math.abs(high) || 1;
    return [low - air, high + air];
  };

  // Labels of a time axis. If the step is a day or more, they are dates. Otherwise they are times,
  // with seconds if the step is below a minute; the first time and midnight also have the date.
  const times = (chart, ticks, axis, space, step) =>
    ticks.map((tick, k) => {
      if (step >= 86400) return text.day(tick).slice(k === 0 ? 0 : 5);
      const [day, time] = (step < 60 ? text.second(tick) : text.minute(tick)).split(' ');
      return k === 0 || /^00:00(:00)?$/.test(time) ? `${time}\n${day}` : time;
    });
  // The steps of uPlot's time axis from 1 s up. With shorter steps, neighbouring labels would be
  // equal.
  const steps = [...[1, 5, 10, 15, 30].flatMap((n) => [n, 60 * n]).sort((a, b) => a - b),
    ...[1, 2, 3, 4, 6, 8, 12].map((n) => 3600 * n), ...[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15, 30, 60, 90, 120, 180].map((n) => 86400 * n),
    ...[1, 2, 5, 10, 25, 50, 100].map((n) => 365 * 86400 * n)];
  const wholes = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6];

  const drawMarks = (chart, marks) => {
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    for (const mark of marks) {
      const y = chart.valToPos(mark.value, 'y', true);
      if (y < bbox.top - 1 || y > bbox.top + bbox.height + 1) continue;
      ctx.strokeStyle = ctx.fillStyle = colour(mark.colour ?? 'bad');
      ctx.setLineDash(mark.dashed === false ? [] : [6 * devicePixelRatio, 4 * devicePixelRatio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      ctx.textAlign = 'right';
      ctx.textBaseline = 'bottom';
      ctx.fillText(mark.label, bbox.left + bbox.width - 4 * devicePixelRatio, y - 2 * devicePixelRatio);
    }
    ctx.restore();
  };

  // Draws dots, and crosses where `isBad(k)`; marks at the same position are drawn once.
  const drawPoints = (chart, x, points) => {
    const { ctx, bbox } = chart;
    const size = (x.length > 4000 ? 1.5 : 3) * devicePixelRatio;
    const width = Math.ceil(bbox.width / size) + 2;
    const taken = new Uint8Array(width * (Math.ceil(bbox.height / size) + 2));
    const dots = new Path2D();
    const crosses = new Path2D();
    for (let k = 0; k < x.length; ++k) {
      const value = points.values[k];
      if (!Number.isFinite(value)) continue;
      const px = chart.valToPos(x[k], 'x', true);
      const py = chart.valToPos(value, 'y', true);
      const cx = Math.floor((px - bbox.left) / size);
      const cy = Math.floor((py - bbox.top) / size);
      if (cx < 0 || cy < 0 || px > bbox.left + bbox.width || py > bbox.top + bbox.height) continue;
      const bad = points.isBad(k);
      const bit = bad ? 2 : 1;
      const cell = cy * width + cx;
      if (taken[cell] & bit) continue;
      taken[cell] |= bit;
      if (bad) {
        const arm = 1.4 * Math.max(size, 3 * devicePixelRatio);
        crosses.moveTo(px - arm, py - arm);
        crosses.lineTo(px + arm, py + arm);
        crosses.moveTo(px - arm, py + arm);
        crosses.lineTo(px + arm, py - arm);
      } else if (x.length > 4000) {
        dots.rect(px - size, py - size, 2 * size, 2 * size);
      } else {
        dots.moveTo(px + size, py);
        dots.arc(px, py, size, 0, 2 * Math.PI);
      }
      if (points.sigmas && points.sigmas[k] > 0) {
        crosses.moveTo(px, chart.valToPos(value - points.sigmas[k], 'y', true));
        crosses.lineTo(px, chart.valToPos(value + points.sigmas[k], 'y', true));
      }
    }
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.fillStyle = colour('dot');
    ctx.globalAlpha = 0.75;
    ctx.fill(dots);
    ctx.globalAlpha = 1;
    ctx.strokeStyle = points.sigmas ? colour('dot') : colour('cross');
    ctx.lineWidth = 1.6 * devicePixelRatio;
    ctx.stroke(crosses);
    ctx.restore();
  };

  const axis = (more) => ({
    stroke: colour('soft'),
    font: '11px system-ui, sans-serif',
    grid: { stroke: colour('grid'), width: 1 },
    ticks: { stroke: colour('grid'), width: 1 },
    ...more,
  });

  const seriesOf = (line) => ({
    scale: line.scale ?? 'y',
    stroke: colour(line.colour),
    fill: line.kind === 'bars' ? colour(line.colour) : undefined,
    width: line.kind === 'bars' ? 0 : 2,
    dash: line.kind === 'dashed' ? [6, 4] : undefined,
    paths: line.kind === 'bars' ? window.uPlot.paths.bars({ size: [0.7, 40] }) : undefined,
    // A single point makes no line, so it is drawn as a dot.
    points: { show: line.kind === 'bars' || line.bare ? false : line.values.length < 3 || undefined, size: 6 },
    spanGaps: true,
  });

  const optionsOf = (container, stated) => {
    const lines = stated.lines ?? [];
    const points = stated.points;
    const marks = stated.marks ?? [];
    const onY = lines.filter((line) => (line.scale ?? 'y') === 'y').map((line) => line.values);
    const range = stated.range ?? rangeOf([...onY, points?.values ?? [], marks.map((mark) => mark.value)]);
    const hasCount = lines.some((line) => line.scale === 'count');
    return {
      width: container.clientWidth || 600,
      height: container.clientHeight || 240,
      legend: { show: false },
      tzDate: utc,
      scales: {
        x: {
          time: stated.isTime !== false,
          range: (chart, low, high) => {
            // If all times are equal, uPlot would extend the range by years.
            const all = chart.data[0];
            if (all[0] === all[all.length - 1]) high = low;
            const air = stated.air ?? (0.015 * (high - low) || (stated.isTime === false ? 0.5 : 1800));
            return [low - air, high + air];
          },
        },
        y: { range: () => range },
        count: { range: (chart, low, high) => [0, 1.05 * (high || 1)] },
      },
      axes: [
        axis({ space: 80, ...(stated.isTime === false ? { incrs: wholes } : { incrs: steps, values: times }), label: stated.xLabel, labelSize: 18, labelFont: '11px system-ui, sans-serif' }),
        axis({ scale: 'y', size: 64, values: (chart, ticks) => ticks.map((tick) => text.number(tick, 8)) }),
        ...(hasCount ? [axis({ scale: 'count', side: 1, size: 50, grid: { show: false } })] : []),
      ],
      series: [
        {},
        ...lines.map(seriesOf),
        ...(points ? [{ scale: 'y', paths: () => null, points: { show: false } }] : []),
      ],
      cursor: { y: false, points: { show: !points }, drag: { x: true, y: false } },
      hooks: {
        draw: [
          (chart) => {
            if (points) drawPoints(chart, stated.x, points);
            drawMarks(chart, marks);
          },
        ],
        setCursor: [({ cursor: { idx } }) => {
          if (!stated.hover) return;
          const isThere = idx !== null && idx !== undefined && idx < points.values.length;
          stated.hover.textContent = isThere ? ` ${text.flat(stated.serialOf(idx))}: ${text.number(points.values[idx], 6)}` : '';
        }],
      },
    };
  };

  // Draws into `container`, a block with a height of its own:
  //   x, isTime, xLabel; lines [{values, kind, colour, scale}]; points {values, isBad, sigmas};
  //   marks [{value, label, colour}]: levels; range of y; label: what a screen reader says;
  //   serialOf(index): the unit of a point, which a click opens; `hover`: an element that names
  //   this unit while the pointer is at the point.
  const draw = (container, stated) => {
    drawn.get(container)?.chart?.destroy();
    container.replaceChildren();
    drawn.delete(container);
    if (!window.uPlot) {
      container.classList.add('is-missing');
      container.append(element('p', { class: 'soft' }, 'No chart: this page was written by a truetriad without uPlot; build truetriad where npm is installed.'));
      return;
    }
    if (stated.x.length === 0) {
      container.append(element('p', { class: 'soft' }, 'Nothing to draw.'));
      return;
    }
    const frame = element('div', { role: 'img', 'aria-label': stated.label, class: 'frame' });
    container.append(frame);
    const data = [stated.x, ...(stated.lines ?? []).map((line) => line.values)];
    if (stated.points) data.push(stated.points.values);
    const chart = new window.uPlot(optionsOf(container, stated), data, frame);
    if (stated.serialOf) {
      chart.over.addEventListener('click', () => {
        if (chart.cursor.idx !== null && chart.cursor.idx !== undefined) location.hash = `unit=${encodeURIComponent(stated.serialOf(chart.cursor.idx))}`;
      });
      chart.over.classList.add('is-link');
    }
    drawn.set(container, { chart, stated });
  };

  const redraw = () => {
    for (const [container, { stated }] of [...drawn]) {
      if (container.isConnected) draw(container, stated);
      else drawn.delete(container);
    }
  };
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  // Printed charts use the colours of the light style.
  for (const [event, isPrinting] of [['beforeprint', true], ['afterprint', false]]) {
    window.addEventListener(event, () => {
      document.documentElement.toggleAttribute('data-printing', isPrinting);
      redraw();
    });
  }
  let asked = 0;
  window.addEventListener('resize', () => {
    cancelAnimationFrame(asked);
    asked = requestAnimationFrame(() => {
      for (const [container, { chart }] of drawn) {
        if (container.clientWidth > 0) chart.setSize({ width: container.clientWidth, height: container.clientHeight });
      }
    });
  });
  window.fleet.charts = { draw };
})();

// The page of two files of one robot: verdict, causes, both robots in one view, terms.
'use strict';
(() => {
  const result = ReadJson('result'), robots = ReadJson('robots');
  const {AddVerdict, AddSection} = MakeSections();
  const files = robots.map(({file}) => file), agrees = result.verdict === 'pass';
  const colors = ['#e07b1a', '#2f7fd8'], plain = ['#aab4bd', '#8fb4d8'];

  Add(document.querySelector('h1'), Make('b', files[0]), ' and ', Make('b', files[1]));
  const outcomes = {rounding: 'All numbers and terms agree to rounding.', digits: 'All numbers and terms agree within the digits that the files print.'};
  const box = AddVerdict(agrees ? 'pass' : 'fail', agrees ? 'AGREE' : 'DISAGREE',
    Make('p', `The two files describe ${agrees ? 'the same robot' : 'different robots'}. ${agrees ? outcomes[result.outcome] ?? '' : ''}`));
  const unexplained = result.unexplained.map(text => ({text, places: [text.split(': ')[0]], sites: [text.split(': ')[1]], changes: [], explained: null}));
  const causes = [...result.causes, ...unexplained];
  const list = Make('ol', '', {className: 'causes'});

  // A cause marks what it is about, at its links.
  const marksOf = {axis: ['axis'], position: ['frame'], rotation: ['frame'], 'axis point': ['axis'], 'centre of mass': ['com'], mass: ['com'], inertia: ['inertia']};
  const findMarks = cause => cause.sites.flatMap(site => marksOf[site] ?? ['other']);
  const findLinks = (cause, robot) => cause.places.flatMap(place => {
    const [kind, ...rest] = place.split(' '), name = rest.join(' ');
    return robot.links.flatMap((link, i) => (kind === 'joint' ? link.joint : link.name) === name ? [i] : []);
  });

  // The view. -----------------------------------------------------------------------------------------------------------
  const view = Make('div', '', {className: 'view', tabIndex: 0});
  const bend = Make('input', '', {type: 'range', min: -1, max: 1, step: 'any', value: 0, ariaLabel: 'All joints turned'});
  const shows = files.map(() => Make('input', '', {type: 'checkbox', checked: true}));
  const Key = (color, text) => Add(Make('span'), Make('i', '', {style: `background: ${color}`}), ' ' + text);
  const section = Make('section', '', {id: 'replay'});
  AddSection(agrees ? 'Both robots' : 'What differs', Add(Make('div', '', {className: agrees ? '' : 'causes-view'}), ...(agrees ? [] : [list]), Add(section, Card('', view,
    Add(Make('div', '', {className: 'bar'}), Make('span', 'all joints turned'), bend),
    Add(Make('div', '', {className: 'bar soft'}), ...files.map((file, i) => Add(Make('label'), shows[i], Key(colors[i], file)))),
    Make('p', 'Rods join the frames of the links; ellipsoids have their masses and inertias; short bars are the axes of joints. ' +
      'What differs has the colour of its file. Drag to turn, with the right button to move; use the wheel to come nearer.', {className: 'soft'})))));

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
  } catch (error) {
    view.append(Make('p', 'This browser draws nothing in three dimensions (WebGL is off).'));
  }
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xeef2f5);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8a929a, 0.9));
  const sun = new THREE.DirectionalLight(0xffffff, 0.5);
  sun.position.set(2, -3, 4);
  scene.add(sun);
  const camera = new THREE.PerspectiveCamera(35, 16 / 9, 0.001, 500);
  camera.up.set(0, 0, 1);

  const place = (object, {position, quaternion: [w, x, y, z]}) => {
    object.position.set(...position);
    object.quaternion.set(x, y, z, w);
    return object;
  };
  const along = (object, from, to) => {
    object.position.copy(from);
    object.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), to.clone().sub(from).normalize());
    return object;
  };
  const Rod = (radius, length) => new THREE.CylinderBufferGeometry(radius, radius, length, 16).rotateX(Math.PI / 2).translate(0, 0, length / 2);
  const paints = robots.map((_, i) => Object.fromEntries([['plain', plain[i], 0.75 - 0.35 * i], ['body', plain[i], 0.16 - 0.06 * i],
    ['mark', colors[i], 1], ['markedBody', colors[i], 0.45]].map(([name, color, opacity]) => [name,
    new THREE.MeshPhongMaterial({color, opacity, transparent: opacity < 1, depthWrite: opacity === 1})])));
  const reach = Math.max(...robots.map(({links}) => Math.max(...links.map(({position}) => Math.hypot(...position)))), 0.01);

  /** One robot: `moved` of each link turns with its joint. */
  const build = (robot, i) => {
    const group = new THREE.Group();
    const parts = robot.links.map((link, k) => {
      const fixed = place(new THREE.Group(), link), moved = new THREE.Group();
      fixed.add(moved);
      const marked = causes.filter(cause => findLinks(cause, robot).includes(k)).flatMap(findMarks);
      const add = (name, mesh, body = false) => {
        mesh.material = paints[i][marked.includes(name) ? (body ? 'markedBody' : 'mark') : (body ? 'body' : 'plain')];
        moved.add(mesh);
      };
      const thin = (0.02 - 0.005 * i) * reach, axis = new THREE.Vector3(...link.axis).normalize(), anchor = new THREE.Vector3(...link.anchor);
      if (link.kind === 'hinge' || link.kind === 'slide') {
        const half = (marked.includes('axis') ? 0.5 : 0.12) * reach;
        add('axis', along(new THREE.Mesh(Rod(1.2 * thin, 2 * half)), anchor.clone().addScaledVector(axis, -half), anchor.clone().add(axis)));
        if (marked.includes('axis')) {
          const tip = new THREE.Mesh(new THREE.ConeBufferGeometry(3 * thin, 0.14 * reach, 20).rotateX(Math.PI / 2));
          add('axis', along(tip, anchor.clone().addScaledVector(axis, half), anchor.clone().addScaledVector(axis, half + 1)));
        }
      }
      if (marked.includes('frame')) {
        for (const [x, y, z] of [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
          add('frame', along(new THREE.Mesh(Rod(0.6 * thin, (z ? 0.3 : 0.2) * reach)), new THREE.Vector3(), new THREE.Vector3(x, y, z)));
        }
      }
      if (link.ellipsoid) {
        const size = link.ellipsoid.size.map(a => Math.max(a, 1e-4));
        add('inertia', place(new THREE.Mesh(new THREE.SphereBufferGeometry(1, 32, 20).scale(...size)), link.ellipsoid), true);
        add('com', place(new THREE.Mesh(new THREE.SphereBufferGeometry((marked.includes('com') ? 2.6 : 1) * thin, 20, 14)), link.ellipsoid));
      }
      const carrier = robot.links[link.parent], length = Math.hypot(...link.position);
      const rod = carrier && length > 1e-6 ? along(new THREE.Mesh(Rod(thin, length)), new THREE.Vector3(), fixed.position) : null;
      if (rod) rod.material = paints[i][marked.includes('frame') ? 'mark' : 'plain'];
      return {link, fixed, moved, rod, axis, anchor};
    });
    parts.forEach(({link, fixed, rod}) => {
      const carrier = link.parent < 0 ? group : parts[link.parent].moved;
      carrier.add(fixed);
      if (rod) carrier.add(rod);
    });
    scene.add(group);
    return {group, parts};
  };
  const built = robots.map(build);

  /** Where a hinge stands: at 0, or in the middle of its range where that has 0 near an end or outside. Both robots take the first one's. */
  const rest = new Map();
  for (const {joint, kind, range: [lower, upper] = [-1, 1]} of robots.flatMap(({links}) => links)) {
    const margin = 0.05 * (upper - lower);
    if (kind === 'hinge' && !rest.has(joint)) rest.set(joint, lower + margin < 0 && upper - margin > 0 ? 0 : (lower + upper) / 2);
  }
  /** Turns all hinges by up to a radian and moves all slides by up to a tenth of the robot's longest link. */
  const pose = s => {
    for (const {parts} of built) {
      for (const {link, moved, axis, anchor} of parts) {
        if (link.kind === 'hinge') {
          moved.quaternion.setFromAxisAngle(axis, rest.get(link.joint) + s);
          moved.position.copy(anchor).sub(anchor.clone().applyQuaternion(moved.quaternion));
        } else if (link.kind === 'slide') {
          moved.position.copy(axis).multiplyScalar(0.1 * s * reach);
        }
      }
    }
  };

  const draw = () => {
    if (!renderer) return;
    const width = view.clientWidth, height = view.clientHeight;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  };
  let controls = null;
  /** Looks at objects from the front, a little from above, so that they fill the view. */
  const frame = objects => {
    const bounds = new THREE.Box3();
    scene.updateMatrixWorld(true);
    for (const object of objects) bounds.expandByObject(object);
    const ball = bounds.getBoundingSphere(new THREE.Sphere());
    const far = 0.9 * Math.max(ball.radius, 0.2 * reach) / Math.sin(Math.PI * camera.fov / 360) * Math.max(1, 1 / camera.aspect);
    camera.position.copy(ball.center).add(new THREE.Vector3(0.6, -0.75, 0.3).normalize().multiplyScalar(far));
    if (controls) controls.target.copy(ball.center);
    camera.lookAt(ball.center);
    if (controls) controls.update();
    draw();
  };
  const whole = built.map(({group}) => group);
  if (renderer) {
    view.append(renderer.domElement);
    renderer.domElement.setAttribute('role', 'img');
    renderer.domElement.setAttribute('aria-label', 'Both robots in three dimensions');
    controls = new THREE.OrbitControls(camera, renderer.domElement);
    controls.addEventListener('change', draw);
    controls.enableZoom = false;  // the wheel scrolls the page until the view was clicked
    view.addEventListener('pointerdown', () => { controls.enableZoom = true; }, true);
    view.addEventListener('pointerleave', () => { controls.enableZoom = false; });
    new ResizeObserver(draw).observe(view);
  }
  bend.addEventListener('input', () => { pose(Number(bend.value)); draw(); });
  shows.forEach((show, i) => show.addEventListener('change', () => { built[i].group.visible = show.checked; draw(); }));

  // Causes. -------------------------------------------------------------------------------------------------------------
  causes.forEach(cause => {
    const links = robots.map(robot => findLinks(cause, robot));
    const seen = built.flatMap(({parts}, i) => links[i].map(k => parts[k].fixed));
    const look = Make('button', cause.text, {type: 'button', title: 'Show it'});
    look.addEventListener('click', () => {
      frame(seen.length ? seen : whole);
      section.scrollIntoView({block: 'nearest'});
    });
    const share = cause.explained === null ? '' : ` explains ${ShowNumber(100 * cause.explained)} %`;
    const item = Add(Make('li'), look, Make('span', share, {className: 'soft'}));
    const changes = cause.changes.filter(({value, repair}) => value !== repair);
    if (changes.length) {
      const Show = x => x === null ? 'not stated' : String(Number(x.toPrecision(9)));
      Add(item, Add(Make('details'), Make('summary', `${changes.length} number${changes.length > 1 ? 's' : ''}`),
        Card('scroll', Table(['place', 'quantity', 'is', 'would be right'], changes.map(({place: at, quantity, unit, value, repair}) =>
          [at, quantity + (unit ? `, ${unit}` : ''), Show(value), Show(repair)]), 2))));
    }
    list.append(item);
  });

  const checks = Object.entries(result.checks);
  AddSection('Constants and terms', Card('scroll', Table(['', 'largest error', 'bound', 'where'], checks.map(([name, check]) => ({
    className: check.pass ? 'pass' : 'fail',
    cells: [name, check.pass ? ShowNumber(check.max) : Make('span', ShowNumber(check.max ?? NaN), {className: 'badge'}), ShowNumber(check.bound), check.where],
  })))));
  for (const note of result.notes) Add(box, Make('p', note, {className: 'soft'}));
  Add(document.querySelector('footer'), `Made by dexcheck; ${result.samples} states compared. View by three.js (MIT license).`);

  pose(0);
  frame(whole);
  section.robots = {built, pose};
})();

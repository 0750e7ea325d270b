// The run as a scene that can be turned and played. Its shapes are one skinned mesh whose bones are the robot's parts, so
// that a frame takes few draw calls. Times come from and go to the page's clock.
(() => {
  'use strict';
  const box = document.getElementById('replay');
  if (!box) return;
  const scene3d = ReadJson('replay-scene');
  const bytes = ReadBytes('replay-values');
  const clock = window.runClock;
  const view = box.querySelector('.view');
  const find = name => box.querySelector(`[data-part=${name}]`);
  const floats = (begin, count) => new Float32Array(bytes, begin, count);

  const times = scene3d.times;
  const count = times.length;
  const moving = scene3d.parts - 1;
  const start = times[0];
  const end = times[count - 1];
  const positions = floats(scene3d.positions, 3 * moving * count);
  const quaternions = new Int16Array(bytes, scene3d.quaternions, 4 * moving * count);

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true});
  } catch (error) {
    find('message').hidden = false;
    return;
  }
  renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFSoftShadowMap;
  view.prepend(renderer.domElement);
  renderer.domElement.setAttribute('role', 'img');
  renderer.domElement.setAttribute('aria-label', 'Replay of the run in three dimensions');

  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xcdd7e0);
  scene.fog = new THREE.Fog(0xcdd7e0, 8, 26);
  const camera = new THREE.PerspectiveCamera(40, 16 / 9, 0.02, 60);
  camera.up.set(0, 0, 1);
  scene.add(new THREE.HemisphereLight(0xffffff, 0xa8adb3, 0.62));
  const sun = new THREE.DirectionalLight(0xfff6ea, 0.62);
  sun.castShadow = true;
  sun.shadow.mapSize.set(1024, 1024);
  sun.shadow.bias = -0.0006;
  Object.assign(sun.shadow.camera, {left: -1.6, right: 1.6, top: 1.6, bottom: -1.6, near: 0.1, far: 9});
  const sunOffset = new THREE.Vector3(1.6, -1.4, 3.2);
  scene.add(sun, sun.target);

  // Shapes. -----------------------------------------------------------------------------------------------------------
  /** A checkered texture, squares of 0.25 m. */
  const makeFloor = () => {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 128;
    const context = canvas.getContext('2d');
    for (const [x, y] of [[0, 0], [64, 0], [0, 64], [64, 64]]) {
      context.fillStyle = x === y ? '#98a2ab' : '#8f99a3';
      context.fillRect(x, y, 64, 64);
    }
    context.strokeStyle = '#a9b2ba';
    context.strokeRect(0, 0, 128, 128);
    const texture = new THREE.CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.anisotropy = renderer.capabilities.getMaxAnisotropy();
    return texture;
  };

  /** Half spheres with a tube between them, about z. An odd number of rings leaves none on the equator. */
  const makeCapsule = (radius, half) => {
    const geometry = new THREE.SphereBufferGeometry(radius, 20, 15).rotateX(Math.PI / 2);
    const at = geometry.attributes.position;
    for (let i = 0; i < at.count; ++i) at.setZ(i, at.getZ(i) + Math.sign(at.getZ(i)) * half);
    return geometry;
  };

  const makeMesh = mesh => {
    const geometry = new THREE.BufferGeometry();
    const [vertices, vertexCount] = mesh.vertices;
    const [faces, faceCount] = mesh.faces;
    geometry.setAttribute('position', new THREE.BufferAttribute(floats(vertices, 3 * vertexCount).slice(), 3));
    const Index = mesh.bytes === 2 ? Uint16Array : Uint32Array;
    geometry.setIndex(new THREE.BufferAttribute(new Index(bytes, faces, 3 * faceCount).slice(), 1));
    geometry.computeVertexNormals();
    return geometry;
  };

  const [w, x, y, z] = [0, 1, 2, 3];
  const toQuaternion = q => new THREE.Quaternion(q[x], q[y], q[z], q[w]);

  const makeShape = shape => {
    const [a, b, c] = shape.size;
    const geometry = {
      sphere: () => new THREE.SphereBufferGeometry(a, 22, 14),
      capsule: () => makeCapsule(a, b),
      ellipsoid: () => new THREE.SphereBufferGeometry(1, 22, 14).scale(a, b, c),
      cylinder: () => new THREE.CylinderBufferGeometry(a, a, 2 * b, 28).rotateX(Math.PI / 2),
      box: () => new THREE.BoxBufferGeometry(2 * a, 2 * b, 2 * c),
      mesh: () => makeMesh(scene3d.meshes[shape.mesh]),
    }[shape.type]();
    const place = new THREE.Matrix4().compose(new THREE.Vector3(...shape.position), toQuaternion(shape.quaternion),
      new THREE.Vector3(1, 1, 1));
    return geometry.applyMatrix(place);
  };

  /** One geometry of many, each with its part and colour. */
  const merge = shapes => {
    const made = shapes.map(makeShape);
    const total = made.reduce((sum, geometry) => sum + geometry.attributes.position.count, 0);
    const corners = made.reduce((sum, geometry) => sum + geometry.index.count, 0);
    const merged = {
      position: new Float32Array(3 * total), normal: new Float32Array(3 * total), color: new Float32Array(3 * total),
      skinIndex: new Uint16Array(4 * total), skinWeight: new Float32Array(4 * total),
    };
    const index = new Uint32Array(corners);
    let vertex = 0;
    let corner = 0;
    made.forEach((geometry, k) => {
      const shape = shapes[k];
      const n = geometry.attributes.position.count;
      merged.position.set(geometry.attributes.position.array, 3 * vertex);
      merged.normal.set(geometry.attributes.normal.array, 3 * vertex);
      for (let i = vertex; i < vertex + n; ++i) {
        merged.color.set(shape.color.slice(0, 3), 3 * i);
        merged.skinIndex[4 * i] = shape.part;
        merged.skinWeight[4 * i] = 1;
      }
      for (let i = 0; i < geometry.index.count; ++i) index[corner + i] = geometry.index.array[i] + vertex;
      vertex += n;
      corner += geometry.index.count;
    });
    const result = new THREE.BufferGeometry();
    for (const [name, array] of Object.entries(merged)) {
      result.setAttribute(name, new THREE.BufferAttribute(array, array.length / total));
    }
    result.setIndex(new THREE.BufferAttribute(index, 1));
    return result;
  };

  const bones = [...Array(scene3d.parts)].map(() => new THREE.Bone());
  for (const bone of bones) scene.add(bone);
  const skeleton = new THREE.Skeleton(bones, bones.map(() => new THREE.Matrix4()));
  const addSkinned = (shapes, material) => {
    if (shapes.length === 0) return null;
    const mesh = new THREE.SkinnedMesh(merge(shapes), new THREE.MeshPhongMaterial(
      Object.assign({vertexColors: THREE.VertexColors, skinning: true, specular: 0x2b2b2b, shininess: 40}, material)));
    mesh.bind(skeleton, new THREE.Matrix4());
    mesh.frustumCulled = false;
    mesh.castShadow = !material.transparent;
    mesh.receiveShadow = true;
    scene.add(mesh);
    return mesh.material;
  };
  const object = scene3d.object;
  const solid = scene3d.shapes.filter(shape => shape.type !== 'plane');
  const isObject = shape => object !== undefined && shape.part === object.part && shape.color[3] === 1;
  const others = solid.filter(shape => !isObject(shape));
  addSkinned(others.filter(shape => shape.color[3] === 1 && !shape.glow), {});
  addSkinned(others.filter(shape => shape.color[3] === 1 && shape.glow), {emissive: 0x0a5a63});
  const objectPaint = addSkinned(solid.filter(isObject), {});
  for (const opacity of new Set(others.map(shape => shape.color[3]).filter(alpha => alpha < 1))) {
    addSkinned(others.filter(shape => shape.color[3] === opacity), {transparent: true, opacity, depthWrite: false});
  }
  for (const shape of scene3d.shapes.filter(one => one.type === 'plane')) {
    const width = 2 * (shape.size[0] || 40);
    const height = 2 * (shape.size[1] || 40);
    const texture = makeFloor();
    texture.repeat.set(2 * width, 2 * height);
    const floor = new THREE.Mesh(new THREE.PlaneBufferGeometry(width, height), new THREE.MeshLambertMaterial({map: texture}));
    floor.receiveShadow = true;
    floor.position.set(...shape.position);
    floor.quaternion.copy(toQuaternion(shape.quaternion));
    bones[shape.part].add(floor);
  }

  // What is drawn besides the bodies. ---------------------------------------------------------------------------------
  const groups = {forces: new THREE.Group(), tracks: new THREE.Group(), ghost: new THREE.Group()};
  for (const group of Object.values(groups)) scene.add(group);
  const upright = new THREE.Vector3(0, 0, 1);
  const point = (array, row, k, n) => new THREE.Vector3().fromArray(array, 3 * (row * n + k));
  const isFinite3 = p => Number.isFinite(p.x + p.y + p.z);

  const contacts = scene3d.contacts;
  const contactCount = contacts ? contacts.count : 0;
  const contactArray = name => contacts && contacts[name] !== undefined ? floats(contacts[name], 3 * contactCount * count) : null;
  const contactPositions = contactArray('positions');
  const contactForces = contactArray('forces');
  const contactNormals = contactArray('normals');
  const arrows = [];
  const coneHeight = 0.026;
  const headLength = 0.009;
  for (let k = 0; k < contactCount; ++k) {
    const paint = new THREE.MeshPhongMaterial({color: 0xe0102e, emissive: 0x50060f});
    const shaft = new THREE.Mesh(new THREE.CylinderBufferGeometry(0.0018, 0.0018, 1, 12).rotateX(Math.PI / 2).translate(0, 0, 0.5), paint);
    const head = new THREE.Mesh(new THREE.ConeBufferGeometry(0.0042, headLength, 16).rotateX(Math.PI / 2), paint);
    const arrow = new THREE.Group();
    arrow.add(shaft, head);
    let cone = null;
    if (contactNormals) {
      const geometry = new THREE.ConeBufferGeometry(coneHeight * contacts.friction, coneHeight, 40, 1, true)
        .rotateX(-Math.PI / 2).translate(0, 0, coneHeight / 2);
      cone = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({
        color: 0x2fb7ff, emissive: 0x0a3a55, transparent: true, opacity: 0.32, side: THREE.DoubleSide, depthWrite: false,
      }));
      groups.forces.add(cone);
    }
    groups.forces.add(arrow);
    arrows.push({arrow, shaft, head, cone});
  }

  const desired = object && object.desired_positions !== undefined ? floats(object.desired_positions, 3 * count) : null;
  const turned = object && object.desired_quaternions !== undefined ? floats(object.desired_quaternions, 4 * count) : null;
  if (turned) {
    const shapes = solid.filter(shape => shape.part === object.part);
    const geometry = merge(shapes);
    groups.ghost.add(new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({
      color: 0x18c8e8, emissive: 0x06424d, transparent: true, opacity: 0.38, depthWrite: false,
    })));
  }

  const partPosition = (frame, part) => part === 0 ? new THREE.Vector3() : point(positions, frame, part - 1, moving);
  const partQuaternion = (frame, part) => {
    const at = 4 * (frame * moving + part - 1);
    return part === 0 ? new THREE.Quaternion() : toQuaternion(quaternions.slice(at, at + 4)).normalize();
  };

  /** A tube through points at least 5 mm apart; shows what lies before a frame. */
  const makePath = (at, color, radius, opacity) => {
    const path = [];
    const frames = [];
    for (let frame = 0; frame < count; ++frame) {
      const p = at(frame);
      if (!isFinite3(p) || (path.length > 0 && p.distanceTo(path[path.length - 1]) < 0.005)) continue;
      path.push(p);
      frames.push(frame);
    }
    if (path.length < 2) return () => {};
    const segments = Math.min(path.length, 300);
    const sides = 6;
    const tube = new THREE.Mesh(new THREE.TubeBufferGeometry(new THREE.CatmullRomCurve3(path), segments, radius, sides),
      new THREE.MeshPhongMaterial({color, transparent: opacity < 1, opacity, depthWrite: opacity === 1}));
    groups.tracks.add(tube);
    return frame => {
      const reached = frames.filter(one => one <= frame).length / path.length;
      tube.geometry.setDrawRange(0, 6 * sides * Math.floor(reached * segments));
    };
  };
  const showPath = object ? makePath(frame => partPosition(frame, object.part), 0xff8a1f, 0.0022, 1) : () => {};
  if (desired) makePath(frame => point(desired, frame, 0, 1), 0x18c8e8, 0.0036, 0.3);

  /** Where the contacts have been on the object, in its frame. */
  let showTracks = () => {};
  if (object && contactCount > 0) {
    const corners = [];
    const until = [];
    for (let frame = 1; frame < count; ++frame) {
      for (let k = 0; k < contactCount; ++k) {
        const ends = [frame - 1, frame].map(at => point(contactPositions, at, k, contactCount)
          .sub(partPosition(at, object.part)).applyQuaternion(partQuaternion(at, object.part).conjugate()));
        if (!ends.every(isFinite3)) continue;
        for (const p of ends) corners.push(p.x, p.y, p.z);
        until.push(frame);
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(corners, 3));
    const tracks = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: 0x7a1fd0}));
    tracks.frustumCulled = false;
    groups.tracks.add(tracks);
    showTracks = frame => {
      geometry.setDrawRange(0, 2 * until.filter(one => one <= frame).length);
      tracks.position.copy(bones[object.part].position);
      tracks.quaternion.copy(bones[object.part].quaternion);
    };
  }

  // Time. -------------------------------------------------------------------------------------------------------------
  /** The frame at or before a time, and how far the time is on the way to the next one. */
  const findFrame = t => {
    let low = 0;
    let high = count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= t) low = middle; else high = middle - 1;
    }
    const next = Math.min(low + 1, count - 1);
    const fraction = next === low ? 0 : Math.min(Math.max((t - times[low]) / (times[next] - times[low]), 0), 1);
    return [low, next, fraction];
  };

  const showForces = frame => {
    arrows.forEach(({arrow, shaft, head, cone}, k) => {
      const p = point(contactPositions, frame, k, contactCount);
      const force = point(contactForces, frame, k, contactCount);
      const length = force.length() * contacts.meters_per_newton;
      const there = isFinite3(p) && Number.isFinite(length) && length > 0;
      arrow.visible = there;
      if (cone) cone.visible = there;
      if (!there) return;
      arrow.position.copy(p);
      arrow.quaternion.setFromUnitVectors(upright, force.normalize());
      shaft.scale.z = Math.max(length - headLength, 1e-4);
      head.position.z = Math.max(length - headLength / 2, headLength / 2);
      if (!cone) return;
      const normal = point(contactNormals, frame, k, contactCount);
      cone.visible = isFinite3(normal) && normal.length() > 0;
      cone.position.copy(p);
      cone.quaternion.setFromUnitVectors(upright, normal.normalize());
    });
  };

  const pose = t => {
    const [frame, next, fraction] = findFrame(t);
    for (let part = 1; part < scene3d.parts; ++part) {
      bones[part].position.copy(partPosition(frame, part)).lerp(partPosition(next, part), fraction);
      bones[part].quaternion.copy(partQuaternion(frame, part)).slerp(partQuaternion(next, part), fraction);
    }
    const nearest = fraction < 0.5 ? frame : next;
    if (contacts) showForces(nearest);
    if (turned) {
      groups.ghost.position.copy(point(desired, frame, 0, 1)).lerp(point(desired, next, 0, 1), fraction);
      const turn = at => toQuaternion(turned.slice(4 * at, 4 * at + 4));
      groups.ghost.quaternion.copy(turn(frame)).slerp(turn(next), fraction);
      // Where the object is in its place, the two would only flicker.
      const bone = bones[object.part];
      groups.ghost.children[0].visible = groups.ghost.position.distanceTo(bone.position) > 0.0005 ||
          groups.ghost.quaternion.angleTo(bone.quaternion) > 0.01;
    }
    showPath(nearest);
    showTracks(nearest);
  };

  // Camera. -----------------------------------------------------------------------------------------------------------
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  controls.enableKeys = false;
  controls.zoomSpeed = 0.6;
  controls.minDistance = 0.05;
  controls.maxDistance = 25;
  let followed = null;  // where what is followed was when last drawn
  let followedPart = object ? object.part : 0;
  const follow = () => {
    const now = bones[followedPart].position;
    if (followed && find('follow').checked) {
      const step = now.clone().sub(followed);
      camera.position.add(step);
      controls.target.add(step);
    }
    followed = now.clone();
    sun.target.position.copy(controls.target);
    sun.target.position.z = 0.6;
    sun.position.copy(sun.target.position).add(sunOffset);
  };

  /** A camera of the model, moved along with its part. */
  const look = named => {
    followedPart = named.part === 0 && object ? object.part : named.part;
    const moved = partPosition(0, followedPart).negate().add(bones[followedPart].position);
    const forward = new THREE.Vector3(...named.forward);
    camera.fov = named.fovy;
    camera.position.set(...named.position).add(moved);
    // What it looks at is as far away as the object, or as what it goes along with.
    const aim = bones[object ? object.part : followedPart].position;
    const far = Math.max(aim.clone().sub(camera.position).dot(forward), 0.1);
    controls.target.copy(camera.position).addScaledVector(forward, far);
    followed = bones[followedPart].position.clone();
    camera.updateProjectionMatrix();
    controls.update();
    request();
  };

  // Drawing, when something changed and the scene is in view. -----------------------------------------------------------
  let requested = false;
  let seen = false;
  let playing = false;
  let lastTick = 0;
  const resize = () => {
    const width = view.clientWidth;
    const height = view.clientHeight;
    renderer.setSize(width, height, false);
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
    request();
  };
  const draw = () => {
    pose(clock.time);
    // Forces point into the object.
    if (objectPaint) {
      objectPaint.transparent = groups.forces.visible && contactCount > 0;
      objectPaint.opacity = objectPaint.transparent ? 0.4 : 1;
    }
    follow();
    controls.update();
    renderer.render(scene, camera);
  };
  const tick = now => {
    requested = false;
    if (playing) {
      const step = Math.min((now - lastTick) / 1000, 0.25) * Number(find('speed').value);
      lastTick = now;
      if (clock.time + step >= end) play(false);
      clock.set(Math.min(clock.time + step, end), box);
    }
    if (seen) draw();
    if (playing) request();
  };
  function request() {
    if (requested) return;
    requested = true;
    requestAnimationFrame(tick);
  }
  function play(on) {
    if (on && clock.time >= end - 1e-9) clock.set(start, box);
    playing = on;
    lastTick = performance.now();
    find('play').textContent = on ? 'Pause' : 'Play';
    request();
  }

  const slider = find('time');
  slider.min = String(start);
  slider.max = String(end);
  const showTime = t => {
    slider.value = String(t);
    const phase = scene3d.phases.filter(one => one.time <= t).pop();
    find('clock').textContent = `t = ${t.toFixed(3)} s${phase && phase.name ? ', ' + phase.name : ''}`;
    slider.setAttribute('aria-valuetext', find('clock').textContent);
    request();
  };
  clock.listeners.push(showTime);
  clock.isPlaying = () => playing;
  find('play').addEventListener('click', () => play(!playing));
  slider.addEventListener('input', () => {
    play(false);
    clock.set(Number(slider.value), box);
  });
  for (const [name, group] of Object.entries(groups)) {
    const switchGroup = () => {
      group.visible = find(name).checked;
      request();
    };
    find(name).closest('label').hidden = group.children.length === 0;
    find(name).addEventListener('change', switchGroup);
    switchGroup();
  }
  const cameras = find('cameras');
  scene3d.cameras.forEach((named, k) => cameras.append(new Option(named.name, String(k))));
  cameras.closest('label').hidden = scene3d.cameras.length === 0;
  cameras.addEventListener('change', () => look(scene3d.cameras[Number(cameras.value)]));
  controls.addEventListener('change', request);
  // The wheel scrolls the page until the scene was clicked.
  controls.enableZoom = false;
  const activate = () => {
    view.focus({preventScroll: true});
    controls.enableZoom = true;
  };
  view.addEventListener('pointerdown', activate, true);
  view.addEventListener('focus', activate);
  view.addEventListener('blur', () => { controls.enableZoom = false; });
  box.addEventListener('keydown', event => {
    if (event.target !== view) return;
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (event.key !== ' ' && !step) return;
    event.preventDefault();
    play(event.key === ' ' && !playing);
    if (step) clock.set(Math.min(Math.max(clock.time + step * (end - start) / 100, start), end), box);
  });
  new ResizeObserver(resize).observe(view);
  new IntersectionObserver(entries => {
    seen = entries[entries.length - 1].isIntersecting;
    request();
  }).observe(view);

  resize();
  pose(start);
  if (scene3d.cameras.length > 0) {
    look(scene3d.cameras[0]);
  } else {
    camera.position.set(2.4, -1.8, 1.1);
  }
  showTime(clock.time);
  box.replay = {THREE, scene, camera, controls, renderer, bones, groups, draw, resize, look: k => look(scene3d.cameras[k])};
})();

// MuJoCo 3 under Node as a program of dexcheck's protocol (harness/descriptions/README.md):
//   node mujoco3.mjs ROBOT.urdf|ROBOT.xml [FOLDER]
// It needs the package @mujoco/mujoco (npm install @mujoco/mujoco), which is looked for in FOLDER, beside this file
// and where the command was started.

import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join, resolve} from 'node:path';
import {createInterface} from 'node:readline';
import {fileURLToPath, pathToFileURL} from 'node:url';

const kFree = 0;
const kBall = 1;
const kHinge = 3;
const kSlide = 2;

async function loadMujoco(folder) {
  const places = [folder, dirname(fileURLToPath(import.meta.url)), process.cwd()].filter(Boolean);
  for (const place of places) {
    let entry;
    try {
      entry = createRequire(join(resolve(place), 'any.js')).resolve('@mujoco/mujoco');
    } catch {
      continue;
    }
    return (await import(pathToFileURL(entry))).default();
  }
  throw new Error(`the npm package @mujoco/mujoco is not installed in ${places.join(', ')}`);
}

// Files that the MJCF names, for the engine's own file system.
function collectFiles(mujoco, path, text) {
  const files = new mujoco.MjVFS();
  const folders = ['', ...[...text.matchAll(/(?:meshdir|texturedir|assetdir)="([^"]*)"/g)].map((match) => match[1])];
  for (const [, name] of text.matchAll(/\sfile="([^"]*)"/g)) {
    for (const folder of folders) {
      try {
        files.addBuffer(join(folder, name), readFileSync(join(dirname(path), folder, name)));
        break;
      } catch {
        // another folder, or the engine says what it misses
      }
    }
  }
  return files;
}

class Robot {
  constructor(mujoco, path) {
    this.mujoco = mujoco;
    const text = readFileSync(path, 'utf8');
    this.isUrdf = /<robot[\s>]/.test(text);
    this.model = /\sfile="/.test(text) ? mujoco.MjModel.from_xml_string(text, collectFiles(mujoco, path, text)) :
                                         mujoco.MjModel.from_xml_string(text);
    this.data = new mujoco.MjData(this.model);
    this.buffer = new mujoco.DoubleBuffer(this.model.nv * this.model.nv);
  }

  greet(robot) {
    const {model} = this;
    // A URDF states no gravity.
    if (this.isUrdf) model.opt.gravity.set(robot.gravity);
    this.gravity = Array.from(model.opt.gravity);
    const answer = {dexcheck_protocol: 1, name: `MuJoCo ${this.mujoco.mj_versionString()}`, joints: []};
    for (let i = 0; i < model.njnt; ++i) {
      const type = model.jnt_type[i];
      if (type === kHinge || type === kSlide || type === kBall) {
        answer.joints.push(model.jnt(i).name);
      } else if (type !== kFree || i > 0) {
        throw new Error(`joint ${model.jnt(i).name}: neither hinge, slide, ball nor the base's free joint`);
      }
    }
    const floats = model.njnt > 0 && model.jnt_type[0] === kFree;
    if (floats !== (robot.base === 'floating')) {
      throw new Error(floats ? 'the base floats here and is fixed there' : 'the base is fixed here and floats there');
    }
    return answer;
  }

  // The engine's bias: C v + gravity.
  bias(q, v, gravity) {
    const {data, model, mujoco} = this;
    model.opt.gravity.set(gravity);
    data.qpos.set(q);
    data.qvel.set(v);
    mujoco.mj_forward(model, data);
    return Array.from(data.qfrc_bias);
  }

  evaluate({id, q, v}) {
    const {data, model, mujoco} = this;
    const zero = v.map(() => 0);
    const c = this.bias(q, v, [0, 0, 0]);
    const friction = Array.from(data.qfrc_damper ?? data.qfrc_passive, (force) => -force);
    const g = this.bias(q, zero, this.gravity);
    mujoco.mj_energyPos(model, data);
    const potential = data.energy[0];
    data.qvel.set(v);
    mujoco.mj_fwdVelocity(model, data);
    mujoco.mj_energyVel(model, data);
    mujoco.mj_fullM(model, data, this.buffer);
    const entries = this.buffer.GetView();
    const M = v.map((_, row) => Array.from(entries.slice(row * v.length, (row + 1) * v.length)));
    return {id, M, c, g, friction, kinetic_energy: data.energy[1], potential_energy: potential};
  }
}

// The engine says on standard output what belongs to standard error.
console.log = console.info = console.warn = console.error;

let robot;
for await (const line of createInterface({input: process.stdin})) {
  let answer;
  try {
    const request = JSON.parse(line);
    if (request.request === 'hello') {
      robot = new Robot(await loadMujoco(process.argv[3]), process.argv[2]);
      answer = robot.greet(request.robot);
    } else {
      answer = robot.evaluate(request);
    }
  } catch (error) {
    answer = {error: String(error.message ?? error).replace(/\s+/g, ' ').trim()};
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}

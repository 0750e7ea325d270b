#!/usr/bin/env bash
# A run's log as MCAP, read back by @mcap/core (npm): mcap_test.sh DEXCHECK
# Exit code 77 when npm or its registry cannot be reached.
set -euo pipefail

dexcheck=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
command -v npm >/dev/null || { echo "npm is not installed"; exit 77; }
timeout 60 npm install --silent --no-audit @mcap/core@2 >npm.txt 2>&1 || { echo "@mcap/core cannot be fetched: $(tail -1 npm.txt)"; exit 77; }

"$dexcheck" run paper --set duration=0.05 --no-report --quiet --out run >/dev/null
"$dexcheck" export run --signals 'object/X_o,contact/force,check/M_bar,engine/qpos' --every 5 --mcap run.mcap --csv run.csv
cat >read.mjs <<'E2'
import {open} from 'node:fs/promises';
import {readFileSync} from 'node:fs';
import * as core from '@mcap/core';
const file = await open('run.mcap');
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, Number(length), Number(offset));
    return bytes;
  },
};
const reader = await core.McapIndexedReader.Initialize({readable});
const topics = new Map([...reader.channelsById.values()].map(channel => [channel.id, channel.topic]));
const rows = new Map();
for await (const message of reader.readMessages()) {
  const topic = topics.get(message.channelId);
  if (!rows.has(topic)) rows.set(topic, []);
  rows.get(topic).push([Number(message.logTime) / 1e9, JSON.parse(new TextDecoder().decode(message.data))]);
}
const [head, ...lines] = readFileSync('run.csv', 'utf8').trim().split('\n');
const names = head.split(',');
const column = name => names.findIndex(one => one.startsWith(name + ' ['));
const check = (is, what) => { if (!is) throw new Error(what); };
check(topics.size === 4 && lines.length === 10, `${topics.size} topics, ${lines.length} lines`);
for (const topic of topics.values()) check(rows.get(topic).length === 10, `${topic}: ${rows.get(topic)?.length} messages`);
lines.forEach((line, row) => {
  const values = line.split(',').map(Number);
  const [time, pose] = rows.get('/object/X_o')[row];
  check(Math.abs(time - values[0]) < 1e-9, `time ${time} is not ${values[0]}`);
  for (const name of ['x', 'y', 'z', 'alpha', 'beta', 'gamma']) {
    check(pose[name] === values[column(`object/X_o.${name}`)], `${name} of row ${row}: ${pose[name]}`);
  }
  check(rows.get('/check/M_bar')[row][1].value === values[column('check/M_bar')], `M_bar of row ${row}`);
  check(rows.get('/contact/force')[row][1]['rf1_tip.x'] === values[column('contact/force.rf1_tip.x')], `force of row ${row}`);
});
const schema = JSON.parse(new TextDecoder().decode([...reader.schemasById.values()].find(s => s.name === 'object/X_o').data));
check(schema.properties.x.description === 'm' && schema.properties.beta.description === 'rad', 'units of the schema');
console.log(`@mcap/core reads ${rows.size} topics of ${lines.length} messages`);
E2
node read.mjs

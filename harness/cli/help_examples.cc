#include "harness/cli/help_examples.h"

#include <algorithm>
#include <iterator>

namespace dexcheck::cli {
namespace {

constexpr CommandExamples kExamples[] = {
    {"consistency", "dexcheck arm.urdf arm.xml --page files.html",
     "dexcheck consistency arm.urdf --program 'python3 mine.py'"},
    {"diagnose", "dexcheck diagnose arm.urdf arm.xml",
     "dexcheck diagnose arm.urdf arm.xml --write repaired.urdf"},
    {"audit", "dexcheck audit arm.urdf", "dexcheck audit arm.xml --junit audit.xml"},
    {"import", "dexcheck import arm.urdf --out arm.toml",
     "dexcheck import newer.xml --downgrade --out arm.xml"},
    {"eval", "dexcheck eval arm.toml arm.xml --state state.json",
     "dexcheck eval arm.urdf --states 1000 --out states"},
    {"engines", "dexcheck engines arm.urdf", "dexcheck engines arm.urdf --engine 'mine=python3 mine.py'"},
    {"run", "dexcheck run paper --out my_run", "dexcheck run motion.toml --controller law.py"},
    {"report", "dexcheck report my_run", "dexcheck report my_run --tex results.tex"},
    {"render", "dexcheck render my_run --camera follow",
     "dexcheck render my_run --still 2.5 --out still.png"},
    {"export", "dexcheck export my_run --list",
     "dexcheck export my_run --csv run.csv --signals 'object/*,tau'"},
    {"compare", "dexcheck compare run_a run_b --page comparison.html",
     "dexcheck compare run_a run_b --tolerance 1e-9"},
    {"judge", "dexcheck judge arm.urdf recording.csv --page judged.html",
     "dexcheck judge arm.urdf recording.csv --columns columns.toml"},
    {"study", "dexcheck study run gains --db gains.sqlite", "dexcheck study report gains.sqlite"},
    {"study run", "dexcheck study run gains --db gains.sqlite",
     "dexcheck study run my_study.toml --db part.sqlite --shard 1/4"},
    {"study merge", "dexcheck study merge all.sqlite part1.sqlite part2.sqlite",
     "dexcheck study merge all.sqlite part1.sqlite --quiet"},
    {"study report", "dexcheck study report gains.sqlite",
     "dexcheck study report gains.sqlite --page gains.html"},
    {"study show", "dexcheck study show gains.sqlite 3",
     "dexcheck study show gains.sqlite 3 --json trial.json"},
    {"study export", "dexcheck study export gains.sqlite",
     "dexcheck study export gains.sqlite --out gains.csv"},
    {"study slurm", "dexcheck study slurm gains --tasks 16",
     "dexcheck study slurm my_study.toml --tasks 16 --time 01:00:00"},
    {"budget", "dexcheck budget curve-real", "dexcheck budget motion.toml --set duration=2"},
    {"mutate", "dexcheck mutate arm.toml arm.xml",
     "dexcheck mutate panda-reach --draws 20 --page faults.html"},
    {"excite", "dexcheck excite arm.urdf --out motion.csv", "dexcheck excite arm.urdf --limits limits.toml"},
    {"init", "dexcheck init arm.urdf arm.xml --out my_arm", "dexcheck init --from panda-reach"},
    {"completion", "dexcheck completion bash > ~/.local/share/bash-completion/completions/dexcheck",
     "source <(dexcheck completion bash)"},
    {"version", "dexcheck version", "dexcheck version > versions.txt"},
};

}  // namespace

std::string FindExamples(const std::string& command) {
  const auto* const found = std::ranges::find(kExamples, command, &CommandExamples::command);
  if (found == std::end(kExamples)) return "";
  return std::string("Examples:\n  ") + found->first + "\n  " + found->second;
}

}  // namespace dexcheck::cli

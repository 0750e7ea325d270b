// Every number of the engine's model is seen: changed, it is found and named, or nothing that moves changes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <variant>

// Here and not by the compiler's include path alone: the engine's list of its own fields.
#include <mujoco/mjxmacro.h>

#include "harness/comparison/consistency.h"
#include "harness/comparison/engine_constants.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paper_robot.h"
#include "tests/harness/comparison/engine_fields.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::engine_fields_test {
namespace {

const std::string kMjcf = SourcePath("/mjcf/");

/// One field of a model: its numbers, as bytes.
struct Field {
  std::string name;
  std::variant<mjtNum*, float*, int*, mjtByte*, char*> values;
  int count;    // of elements
  int columns;  // numbers of each

  [[nodiscard]] std::span<char> bytes() const {
    return std::visit(
        [&](auto* first) {
          return std::span(reinterpret_cast<char*>(first),
                           sizeof(*first) * static_cast<size_t>(count) * static_cast<size_t>(columns));
        },
        values);
  }
};

std::vector<Field> ListFields(mjModel* m) {
  std::vector<Field> fields;
  MJMODEL_POINTERS_PREAMBLE(m)
#define X(name) fields.push_back({#name, &m->name, 1, 1});
  MJMODEL_INTS
#undef X
// The sizes are members of the model, unless they are numbers.
#define X(type, name, rows, columns) fields.push_back({#name, m->name, m->rows, static_cast<int>(columns)});
  MJMODEL_POINTERS
#undef X
#define X(type, name) fields.push_back({"opt." #name, &m->opt.name, 1, 1});
  MJOPTION_SCALARS
#undef X
#define X(name, size) fields.push_back({"opt." #name, m->opt.name, 1, size});
  MJOPTION_VECTORS
#undef X
  mjStatistic& stat = m->stat;
  fields.push_back({"stat.meaninertia", &stat.meaninertia, 1, 1});
  fields.push_back({"stat.meanmass", &stat.meanmass, 1, 1});
  fields.push_back({"stat.meansize", &stat.meansize, 1, 1});
  fields.push_back({"stat.extent", &stat.extent, 1, 1});
  fields.push_back({"stat.center", stat.center, 1, 3});
  return fields;
}

/// Changes a number to another that the engine survives.
void Change(const Field& field, int index) {
  if (auto* const reals = std::get_if<mjtNum*>(&field.values)) {
    mjtNum& x = (*reals)[index];
    x += 1e-3 + 0.01 * x;
  } else if (auto* const floats = std::get_if<float*>(&field.values)) {
    float& x = (*floats)[index];
    x += 1e-3F + 0.01F * x;
  } else if (auto* const whole = std::get_if<int*>(&field.values)) {
    // A contact has 1, 3, 4 or 6 dimensions; transmissions 0 and 1 are the same for a hinge.
    const bool by_two =
        field.name == "geom_condim" || field.name == "pair_dim" || field.name == "actuator_trntype";
    (*whole)[index] ^= by_two ? 2 : 1;
  } else if (auto* const flags = std::get_if<mjtByte*>(&field.values)) {
    (*flags)[index] = (*flags)[index] == 0 ? 1 : 0;
  } else {
    std::get<char*>(field.values)[index] ^= 1;
  }
}

/// All bits that the engine makes of a state: of the smooth terms, and of some steps of the plant.
struct Motion {
  std::vector<mjtNum> numbers;
  void Add(const mjtNum* values, int count) { numbers.insert(numbers.end(), values, values + count); }
  bool operator==(const Motion& other) const {
    return numbers.size() == other.numbers.size() &&
           std::memcmp(numbers.data(), other.numbers.data(), sizeof(mjtNum) * numbers.size()) == 0;
  }
};

/// A robot, the engine's model of it, and what the checks say of both.
class Subject {
 public:
  Subject(RobotModel model, const std::filesystem::path& mjcf, const char* key)
      : model_(std::move(model)), engine_(LoadMjcf(mjcf)) {
    // The compiler's short cuts past places and moments that are zero: a changed one must act.
    mjModel& m = *engine_;
    std::memset(m.body_sameframe, 0, static_cast<size_t>(m.nbody));
    std::memset(m.geom_sameframe, 0, static_cast<size_t>(m.ngeom));
    std::memset(m.site_sameframe, 0, static_cast<size_t>(m.nsite));
    std::memset(m.body_simple, 0, static_cast<size_t>(m.nbody));
    std::fill_n(m.dof_simplenum, m.nv, 0);
    const int id = mj_name2id(engine_.get(), mjOBJ_KEY, key);
    qpos_.assign(engine_->qpos0, engine_->qpos0 + engine_->nq);
    for (int i = 0; i < engine_->njnt; ++i) {
      if (engine_->jnt_limited[i] != 0)
        qpos_[static_cast<size_t>(engine_->jnt_qposadr[i])] =
            0.5 * (engine_->jnt_range[2 * i] + engine_->jnt_range[2 * i + 1]);
    }
    if (id >= 0)
      qpos_.assign(engine_->key_qpos + engine_->nq * id, engine_->key_qpos + engine_->nq * (id + 1));
  }

  [[nodiscard]] MjModelPtr Copy() const { return MjModelPtr(mj_copyModel(nullptr, engine_.get())); }

  /// Names of the failed checks and texts of the notes.
  struct Verdict {
    std::set<std::string> failed;
    std::multiset<std::string> notes;
  };
  /// @param terms whether the terms are compared at a random state, besides the constants.
  [[nodiscard]] Verdict Judge(const mjModel& engine, bool terms) const {
    Verdict verdict;
    try {
      const Adapter adapter(model_, engine, "mjcf");
      ConsistencyResult result;
      result.constants = CheckConstants(adapter);
      for (const ConstantNote& note : result.constants.notes)
        verdict.notes.insert(note.kind + ": " + note.text);
      for (const ConstantFinding& finding : result.constants.findings) verdict.failed.insert(finding.check);
      ConsistencyOptions options;
      options.samples = 1;
      if (terms) result = CheckConsistency(adapter, options, [](long) { return true; });
      for (const auto* records : {&result.constants.records, &result.terms}) {
        for (const CheckRecord& record : *records) {
          if (record.failed) verdict.failed.insert(record.name);
        }
      }
    } catch (const InputError& error) {
      verdict.failed.insert(error.what());
    }
    return verdict;
  }

  /// Mass matrix, bias and passive forces, Jacobians of sites; and three steps with torques.
  [[nodiscard]] Motion Move(const mjModel& engine) const {
    const mjModel* m = &engine;
    const MjDataPtr data = MakeData(*m);
    mjData* d = data.get();
    mju_copy(d->qpos, qpos_.data(), m->nq);
    // Pressed on the floor, all that is free: without an overlap nothing touches.
    constexpr double kOverlap = 1e-4;  // m
    for (int i = 0; i < m->njnt; ++i) {
      if (m->jnt_type[i] == mjJNT_FREE) d->qpos[m->jnt_qposadr[i] + 2] -= kOverlap;
    }
    for (int i = 0; i < m->nv; ++i) d->qvel[i] = 0.1 * std::sin(1.0 + i);
    Motion motion;
    mj_step1(m, d);
    contacts_ = d->ncon;
    std::vector<mjtNum> M(static_cast<size_t>(m->nv) * static_cast<size_t>(m->nv));
    ExpandMass(*m, *d, M.data());
    motion.Add(M.data(), m->nv * m->nv);
    motion.Add(d->qfrc_bias, m->nv);
    motion.Add(d->qfrc_passive, m->nv);
    std::vector<mjtNum> J(6 * static_cast<size_t>(m->nv));
    for (int site = 0; site < m->nsite; ++site) {
      mj_jacSite(m, d, J.data(), J.data() + 3 * m->nv, site);
      motion.Add(J.data(), 6 * m->nv);
    }
    for (int step = 0; step < 3; ++step) {
      if (step > 0) mj_step1(m, d);
      for (int i = 0; i < m->nu; ++i) d->ctrl[i] = 0.2 * std::cos(i) / m->actuator_gear[6 * i];
      mj_step2(m, d);
      motion.Add(d->qacc, m->nv);
    }
    motion.Add(d->qpos, m->nq);
    motion.Add(d->qvel, m->nv);
    return motion;
  }
  /// Moves the model that a run makes of it: nothing when no run has this robot.
  [[nodiscard]] Motion MoveAsInRun(const mjModel& engine) const {
    if (!model_.object()) return {};
    static const Scenario scenario = ReadShippedScenario("hold");
    const Setup setup(scenario, SourcePath("/controller/parameters/assistant_robot.toml"), "mjcf",
                      MjModelPtr(mj_copyModel(nullptr, &engine)));
    return Move(setup.engine());
  }
  [[nodiscard]] int contacts() const { return contacts_; }

 private:
  RobotModel model_;
  MjModelPtr engine_;
  std::vector<mjtNum> qpos_;
  mutable int contacts_ = 0;
};

/// The assistant robot's scene with elements of all kinds besides that do nothing.
class EngineFields : public ::testing::Test {
 protected:
  EngineFields() {
    std::filesystem::copy(
        kMjcf, folder_.path(),
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    WriteText(folder_.path() / "rich.xml", R"(<mujoco>
  <include file="scene.xml"/>
  <size nuser_body="1" nuser_jnt="1" nuser_site="1" nuser_cam="1" nuser_tendon="1" nuser_actuator="1" nuser_sensor="1"/>
  <worldbody>
    <body name="marker" mocap="true" pos="1 1 1"><geom size="0.01" contype="0" conaffinity="0"/></body>
  </worldbody>
  <tendon>
    <fixed name="coupling"><joint joint="r_elbow" coef="1"/><joint joint="l_elbow" coef="2"/></fixed>
    <spatial name="string"><site site="rf1_tip"/><site site="lf1_tip"/></spatial>
  </tendon>
  <equality><joint name="tied" joint1="r_elbow" joint2="l_elbow" active="false"/></equality>
  <actuator><motor name="second" joint="r_elbow" forcelimited="true" forcerange="-1 1"/></actuator>
  <sensor>
    <jointpos joint="r_elbow" noise="0.1" cutoff="1"/>
    <touch site="rf1_tip"/>
    <magnetometer site="base_frame"/>
  </sensor>
  <custom>
    <numeric name="number" data="1 2"/><text name="text" data="words"/>
    <tuple name="pair"><element objtype="body" objname="torus" prm="1"/></tuple>
  </custom>
</mujoco>)");
  }
  TempFolder folder_;
};

/// Each field's elements, all of one number and some by themselves: what is seen of each change must be what
/// its class says. Counts by field how often a change was named by the check of the table.
class FieldCheck {
 public:
  explicit FieldCheck(const Subject& subject)
      : subject_(subject),
        before_(subject.Copy()),
        verdict_(subject.Judge(*before_, true)),
        motion_(subject.Move(*before_)),
        run_(subject.MoveAsInRun(*before_)) {
    EXPECT_TRUE(verdict_.failed.empty()) << *verdict_.failed.begin();
    for (const EngineField& field : ListEngineFields()) table_[field.name] = field;
  }

  void Run(std::map<std::string, int>* named, std::map<std::string, int>* tried) {
    const MjModelPtr model = subject_.Copy();
    for (const Field& field : ListFields(model.get())) {
      const EngineField& row = table_.at(field.name);
      const int size = field.count * field.columns;
      if (row.outcome == FieldClass::kDerived || size == 0) continue;
      // Every number at once, and single ones of the first and of a middle element.
      std::vector<std::vector<int>> sets(1);
      for (int i = 0; i < size; ++i) sets[0].push_back(i);
      for (const int element : std::set<int>{0, field.count / 2}) {
        const int column = element % field.columns;
        sets.push_back({element * field.columns + column});
      }
      for (const std::vector<int>& set : sets) {
        const std::span<char> bytes = field.bytes();
        const std::vector<char> kept(bytes.begin(), bytes.end());
        for (const int i : set) Change(field, i);
        ++(*tried)[field.name];
        (*named)[field.name] += Look(*model, field.name, row) ? 1 : 0;
        std::ranges::copy(kept, bytes.begin());
      }
    }
  }

 private:
  /// Whether the change is named as the table says; a change that nothing names must move nothing.
  bool Look(const mjModel& model, const std::string& name, const EngineField& row) {
    const bool terms = row.outcome == FieldClass::kCompared;
    const Subject::Verdict now = subject_.Judge(model, terms);
    switch (row.outcome) {
      case FieldClass::kNoEffect:
        EXPECT_TRUE(now.failed.empty()) << name << ": " << *now.failed.begin();
        EXPECT_EQ(now.notes, verdict_.notes) << name;
        EXPECT_TRUE(subject_.Move(model) == motion_) << name << " moves the robot";
        return true;
      case FieldClass::kOverridden:
        EXPECT_TRUE(now.failed.empty()) << name << ": " << *now.failed.begin();
        EXPECT_TRUE(subject_.MoveAsInRun(model) == run_) << name << " is not overridden";
        return true;
      case FieldClass::kCompared:
      case FieldClass::kReported:
        if (!now.failed.empty()) return now.failed.contains(row.how);
        break;
      case FieldClass::kJudged:
        EXPECT_TRUE(now.failed.empty()) << name << ": " << *now.failed.begin();
        break;
      case FieldClass::kDerived:
        return false;
    }
    if (now.notes != verdict_.notes) {
      const auto names = [&](const auto& some, const auto& others) {
        return std::ranges::any_of(some, [&](const std::string& note) {
          return note.starts_with(row.how) && !others.contains(note);
        });
      };
      return names(now.notes, verdict_.notes) || names(verdict_.notes, now.notes);
    }
    EXPECT_TRUE(subject_.Move(model) == motion_) << name << " moves the robot, and nothing says so";
    return false;
  }

  const Subject& subject_;
  MjModelPtr before_;
  Subject::Verdict verdict_;
  Motion motion_, run_;
  std::map<std::string, EngineField> table_;
};

TEST_F(EngineFields, AreAllClassed) {
  const MjModelPtr model = LoadMjcf(kMjcf + "panda.xml");
  std::set<std::string> listed;
  for (const EngineField& field : ListEngineFields()) {
    EXPECT_TRUE(listed.insert(field.name).second) << field.name << " is listed twice";
    EXPECT_FALSE(field.how.empty()) << field.name;
  }
  std::set<std::string> fields;
  for (const Field& field : ListFields(model.get())) fields.insert(field.name);
  EXPECT_EQ(listed, fields);

  // The engine's own lists are whole: nothing stands in the structures but what they name.
  size_t options = 0;
#define X(type, name) options += sizeof(model->opt.name);
  MJOPTION_SCALARS
#undef X
#define X(name, size) options += sizeof(model->opt.name);
  MJOPTION_VECTORS
#undef X
  EXPECT_LT(sizeof(mjOption) - options, alignof(mjOption));
  size_t sizes = 0;
  size_t pointers = sizeof(model->buffer);
#define X(name) sizes += sizeof(model->name);
  MJMODEL_INTS
#undef X
#define X(type, name, rows, columns) pointers += sizeof(model->name);
  MJMODEL_POINTERS
#undef X
  const size_t rest =
      sizeof(mjModel) - sizes - pointers - sizeof(mjOption) - sizeof(mjVisual) - sizeof(mjStatistic);
  EXPECT_LT(rest, 2 * alignof(mjModel));
}

TEST_F(EngineFields, ChangedAreNamedOrMoveNothing) {
  std::map<std::string, int> named;
  std::map<std::string, int> tried;
  // Held by the fingers, and on the floor.
  for (const char* key : {"grasp_ready", "home"}) {
    const Subject subject(ReadPaperRobot(), folder_.path() / "rich.xml", key);
    FieldCheck check(subject);
    EXPECT_GT(subject.contacts(), 3) << key;
    check.Run(&named, &tried);
  }
  // Among things that can touch by their type.
  std::string text = ReadText(kMjcf + "panda.xml");
  const std::string end = "</mujoco>";
  text.replace(text.rfind(end), end.size(), R"(<option collision="all"/>
  <worldbody><geom name="table" type="box" size="0.1 0.1 0.1" pos="2 0 0"/></worldbody>
  <contact><exclude body1="panda_link1" body2="panda_link3"/></contact></mujoco>)");
  WriteText(folder_.path() / "rich_panda.xml", text);
  const Subject panda(ReadPanda(), folder_.path() / "rich_panda.xml", "");
  EXPECT_THAT(panda.Judge(*panda.Copy(), false).notes,
              Contains(HasSubstr("excluded: panda_link1 and panda_link3")));
  FieldCheck(panda).Run(&named, &tried);
  for (const EngineField& field : ListEngineFields()) {
    const bool needs_naming = field.outcome == FieldClass::kCompared ||
                              field.outcome == FieldClass::kReported || field.outcome == FieldClass::kJudged;
    if (needs_naming && tried[field.name] > 0)
      EXPECT_GT(named[field.name], 0) << field.name << " is never named by " << field.how;
  }
}

}  // namespace
}  // namespace dexcheck::testing::engine_fields_test

// Which cause follows from which failed checks.

#include "harness/diagnosis/attribution.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <string>
#include <vector>

#include "harness/checks/check_table.h"
#include "tests/common/matchers.h"

namespace dexcheck::testing::attribution_test {
namespace {

struct Step {
  const char* name;
  CheckCategory kind = CheckCategory::kAssumption;
};
constexpr Step kSteps[] = {{"inverse_dynamics_object", CheckCategory::kInverseDynamics},
                           {"inverse_dynamics_robot", CheckCategory::kInverseDynamics},
                           {"rolling"},
                           {"reduced_acceleration"},
                           {"contact_force"},
                           {"fingertip_slip"},
                           {"fingertip_slip_rate"},
                           {"wheel_slip"},
                           {"wheel_slip_rate"},
                           {"cone_use"},
                           {"traction_use"},
                           {"contacts_lost"},
                           {"penetration"},
                           {"kappa"},
                           {"base_tilt"},
                           {"idle_joints"},
                           {"solver"},
                           {"joint_limit"},
                           {"clearance"},
                           {"collision"},
                           {"actuator_effort"}};

CheckRecord MakeCheck(const std::string& name, CheckCategory kind) {
  CheckRecord check;
  check.name = name;
  check.kind = kind;
  check.bound = 1.0;
  check.Add(0.5, 0.0);
  return check;
}

/// Checks of a run, none of which failed yet.
class FakeRun {
 public:
  FakeRun() {
    for (const char* name : {"M_bar", "gravity"}) model_.push_back(MakeCheck(name, CheckCategory::kModel));
    for (const Step& step : kSteps) steps_.push_back(MakeCheck(step.name, step.kind));
    steps_.push_back(MakeCheck("expect_position", CheckCategory::kLaw));
  }

  FakeRun& Fail(const std::string& name, double time) {
    for (std::vector<CheckRecord>* checks : {&model_, &steps_}) {
      for (CheckRecord& check : *checks) {
        if (check.name == name) check.Add(2.0, time);
      }
    }
    return *this;
  }
  FakeRun& FailConstant(const std::string& name) {
    constants_.findings.push_back({name, "link r_forearm", 1.5, 1.25, {}, 0});
    return *this;
  }
  [[nodiscard]] AttributionResult Explain(const CheckContext& context = {}) const {
    Causes causes;
    return Explain(&causes, context);
  }
  AttributionResult Explain(Causes* causes, const CheckContext& context = {}) const {
    return Attribute(constants_, model_, steps_, context, causes);
  }
  [[nodiscard]] double FindVoid() const { return dexcheck::FindVoid(steps_); }
  CheckRecord& step(const std::string& name) {
    return *std::find_if(steps_.begin(), steps_.end(),
                         [&](const CheckRecord& check) { return check.name == name; });
  }

 private:
  ConstantChecks constants_;
  std::vector<CheckRecord> model_, steps_;
};

/// The cause of one failed check; "" when it did not fail.
std::string FindCause(const AttributionResult& result, const std::string& check) {
  for (const Attribution& one : result.attributions) {
    if (one.check == check) return NameOf(one.cause);
  }
  return "";
}

TEST(Attribute, FindsNothingWhereNothingFailed) {
  const AttributionResult result = FakeRun().Explain();
  EXPECT_EQ(result.cause, Cause::kNone);
  EXPECT_EQ(result.evidence, "");
  EXPECT_TRUE(result.attributions.empty());
  Causes causes;
  EXPECT_EQ(Attribute({}, {}, {}, {}, &causes).cause, Cause::kNone);
  EXPECT_TRUE(causes.empty());
}

TEST(Attribute, BlamesConstantsBeforeAllElse) {
  const AttributionResult result = FakeRun()
                                       .FailConstant("link_mass")
                                       .FailConstant("armature")
                                       .Fail("M_bar", 0.1)
                                       .Fail("cone_use", 0.0)
                                       .Explain();
  EXPECT_EQ(result.cause, Cause::kModel);
  EXPECT_EQ(result.evidence, "mass of link r_forearm: 1.5 kg in the model, 1.25 kg in the MJCF");
  EXPECT_EQ(FindCause(result, "M_bar"), "model");
  EXPECT_EQ(FindCause(result, "cone_use"), "model");
  EXPECT_EQ(result.attributions.size(), 2U);
}

struct FailedAt {
  const char* check;
  double time;
};
/// Checks that fail, the cause of the run, how its evidence begins, and the causes of single checks.
struct Attributed {
  std::vector<FailedAt> failed;
  Cause cause;
  const char* evidence = "";
  std::vector<std::pair<const char*, const char*>> causes = {};
};

const Attributed kAttributed[] = {
    {{{"M_bar", 0.5}, {"gravity", 0.25}, {"traction_use", 0.0}},
     Cause::kModel,
     "gravity 2 (bound 1), first above it at t = 0.25 s",
     {{"traction_use", "model"}}},
    // The object's balance lacks a force where the model holds.
    {{{"cone_use", 0.1}, {"inverse_dynamics_object", 0.9}},
     Cause::kUnmodelledForce,
     "inverse_dynamics_object"},
    // Sliding outweighs what gave earlier.
    {{{"wheel_slip", 0.1}, {"penetration", 0.2}, {"base_tilt", 0.1}, {"traction_use", 0.3}},
     Cause::kWheelSlip,
     "traction_use",
     {{"wheel_slip", "wheel slip"}, {"penetration", "contact softness"}, {"base_tilt", "wheel slip"}}},
    // The first of several slips counts; at one time the motor, which can make anything slide.
    {{{"cone_use", 0.2}, {"traction_use", 0.1}},
     Cause::kWheelSlip,
     "traction_use",
     {{"cone_use", "fingertip slip"}}},
    {{{"cone_use", 0.1}, {"traction_use", 0.2}},
     Cause::kFingertipSlip,
     "cone_use",
     {{"traction_use", "wheel slip"}}},
    {{{"cone_use", 0.1}, {"actuator_effort", 0.1}, {"traction_use", 0.1}}, Cause::kActuatorLimit},
    // Slip without sliding, and predictions without a broken assumption, are softness.
    {{{"fingertip_slip", 0.1}, {"reduced_acceleration", 0.05}},
     Cause::kContactSoftness,
     "fingertip_slip",
     {{"reduced_acceleration", "contact softness"}}},
    {{{"wheel_slip_rate", 0.1}, {"reduced_acceleration", 0.05}}, Cause::kContactSoftness, "wheel_slip_rate"},
    {{{"kappa", 0.1}, {"reduced_acceleration", 0.05}}, Cause::kContactSoftness, "kappa"},
    {{{"reduced_acceleration", 0.1}, {"contact_force", 0.2}},
     Cause::kContactSoftness,
     "reduced_acceleration",
     {{"contact_force", "contact softness"}}},
    {{{"idle_joints", 0.1}}, Cause::kUnexplained, "idle_joints"},
    // A force on the robot and what slides are told by time; what slides in the same step tells.
    {{{"inverse_dynamics_robot", 0.1}, {"traction_use", 0.2}, {"base_tilt", 0.05}}, Cause::kUnmodelledForce},
    {{{"inverse_dynamics_robot", 0.2}, {"traction_use", 0.1}, {"base_tilt", 0.05}}, Cause::kWheelSlip},
    {{{"inverse_dynamics_robot", 0.1}, {"cone_use", 0.1}}, Cause::kFingertipSlip},
    // The balance has the push of a joint's limit: what it lacks may push joints into their limits.
    {{{"inverse_dynamics_robot", 0.1}, {"joint_limit", 0.1}}, Cause::kUnmodelledForce},
    {{{"inverse_dynamics_robot", 0.2}, {"joint_limit", 0.1}}, Cause::kJointLimit},
    // Wheels that roll otherwise explain forces, unless they slide.
    {{{"inverse_dynamics_robot", 0.1}, {"rolling", 0.3}}, Cause::kWheelGeometry, "rolling"},
    {{{"traction_use", 0.1}, {"rolling", 0.2}}, Cause::kWheelSlip},
    {{{"solver", 0.1}, {"contact_force", 0.1}}, Cause::kSolver, "solver", {{"contact_force", "solver"}}}};

TEST(Attribute, FollowsFromFailedChecks) {
  for (const Attributed& one : kAttributed) {
    FakeRun run;
    for (const FailedAt& failed : one.failed) run.Fail(failed.check, failed.time);
    const AttributionResult result = run.Explain();
    EXPECT_EQ(result.cause, one.cause) << NameOf(one.cause);
    EXPECT_THAT(result.evidence, StartsWith(one.evidence));
    for (const auto& [check, cause] : one.causes) EXPECT_EQ(FindCause(result, check), cause);
  }
}

/// A fault of the balances.
Explanation MakeForce(const std::string& fault, double from) {
  Explanation one{.channel = CauseChannel::kBalance};
  one.faults.push_back({fault, "joint r_elbow", 0.5, 0.0, "N m", ""});
  one.from = from;
  return one;
}

TEST(Attribute, EvidenceEndsWithWhatExplainsTheResidual) {
  FakeRun run;
  run.Fail("inverse_dynamics_object", 0.1).Fail("inverse_dynamics_robot", 0.1);
  Causes causes = {MakeForce("torque", 0.1)};
  EXPECT_THAT(run.Explain(&causes).evidence, HasSubstr("; joint r_elbow: torque 0.5 N m, from 0.1 s"));
  ASSERT_EQ(causes.size(), 1u);
  causes = {MakeForce("slope", 0.1)};
  const AttributionResult slope = run.Explain(&causes);
  EXPECT_EQ(slope.cause, Cause::kSlope);
  EXPECT_EQ(FindCause(slope, "inverse_dynamics_robot"), "slope");
}

// Facts and faults are one list: what came first of what is decisive explains the others.
TEST(Attribute, RanksFactsAmongFaults) {
  for (const bool fact_first : {true, false}) {
    FakeRun run;
    run.Fail("cone_use", fact_first ? 0.1 : 0.3)
        .Fail("inverse_dynamics_robot", 0.2)
        .Fail("penetration", 0.05);
    Causes causes = {MakeForce("torque", 0.2)};
    const AttributionResult result = run.Explain(&causes);
    ASSERT_EQ(causes.size(), 3u);
    const Explanation& fact = causes[fact_first ? 0 : 1];
    EXPECT_EQ(fact.outcome, CauseOutcome::kObserved);
    EXPECT_EQ(fact.channel, CauseChannel::kObservation);
    EXPECT_EQ(fact.faults.front().fault, "fingertip slip");
    EXPECT_EQ(fact.from, fact_first ? 0.1 : 0.3);
    EXPECT_EQ(causes[fact_first ? 1 : 0].faults.front().fault, "torque");
    EXPECT_EQ(causes[2].faults.front().fault, "contact softness");
    EXPECT_EQ(result.cause, fact_first ? Cause::kFingertipSlip : Cause::kUnmodelledForce);
  }
}

// A failure that a fact makes void is neither a fault nor a fact of its own.
TEST(Attribute, AForceAfterWheelsSlideIsTheirs) {
  FakeRun run;
  run.Fail("traction_use", 0.1).Fail("inverse_dynamics_robot", 0.2).Fail("rolling", 0.2);
  run.Fail("wheel_slip_rate", 0.1).Fail("base_tilt", 0.05);
  EXPECT_EQ(run.FindVoid(), 0.1);
  Causes causes;
  EXPECT_EQ(run.Explain(&causes).cause, Cause::kWheelSlip);
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_EQ(causes[0].faults.front().fault, "wheel slip");
  // Fingertips that slide leave the balances as they are: their forces are known.
  EXPECT_EQ(FakeRun().Fail("cone_use", 0.1).FindVoid(), std::numeric_limits<double>::infinity());
}

// A fault that bounds allow and predictions show is named before what the prediction alone says.
TEST(Attribute, AFaultWithinTheBoundsExplainsThePrediction) {
  FakeRun run;
  run.Fail("reduced_acceleration", 0.2);
  Causes causes = {MakeForce("torque", 0.2)};
  const AttributionResult result = run.Explain(&causes);
  EXPECT_EQ(result.cause, Cause::kUnmodelledForce);
  EXPECT_THAT(result.evidence, StartsWith("reduced_acceleration"));
  EXPECT_EQ(causes.size(), 1u);
}

// An expectation that alone fails: what (57) by itself leaves are the gains, the rest is what drives it.
TEST(Attribute, AnExpectationThatFailsHasAMeasuredCause) {
  FakeRun run;
  run.Fail("expect_position", 1.0);
  CheckContext context;
  context.position_by_law = 1.5;
  AttributionResult result = run.Explain(context);
  EXPECT_EQ(result.cause, Cause::kControlLaw);
  EXPECT_EQ(result.check, "expect_position");
  EXPECT_THAT(result.evidence, HasSubstr("(57) by itself leaves 1.5"));
  context.position_by_law = 0.1;
  result = run.Explain(context);
  EXPECT_EQ(result.cause, Cause::kContactSoftness);
  EXPECT_THAT(result.evidence, HasSubstr("contacts that give the rest"));
  context.is_ideal = false;
  result = run.Explain(context);
  EXPECT_EQ(result.cause, Cause::kDeclared);
  // Not known, for a law that is not followed.
  EXPECT_EQ(run.Explain().cause, Cause::kControlLaw);
}

// Whichever checks fail, in whichever order: there is a cause, each failed check gets one, and the check that
// the run's cause is taken from has the same.
TEST(Attribute, NeverContradictsItself) {
  constexpr unsigned kSets = 1U << std::size(kSteps);
  // All sets of four or less, and every 149th of the others.
  for (unsigned set = 1; set < kSets; ++set) {
    if (std::popcount(set) > 4 && set % 149 != 0) continue;
    for (const bool forward : {true, false}) {
      FakeRun run;
      size_t failed = 0;
      for (size_t i = 0; i < std::size(kSteps); ++i) {
        if ((set >> i & 1U) == 0) continue;
        run.Fail(kSteps[i].name, forward ? 0.1 * static_cast<double>(i) : 2.0 - 0.1 * static_cast<double>(i));
        ++failed;
      }
      const AttributionResult result = run.Explain();
      ASSERT_NE(result.cause, Cause::kNone) << set;
      ASSERT_FALSE(result.evidence.empty()) << set;
      ASSERT_EQ(result.attributions.size(), failed) << set;
      for (const Attribution& one : result.attributions) ASSERT_NE(one.cause, Cause::kNone) << set;
      const std::string evidence = result.evidence.substr(0, result.evidence.find(' '));
      if (result.cause != Cause::kUnexplained) {
        ASSERT_EQ(FindCause(result, evidence), NameOf(result.cause)) << set << " " << evidence;
      }
    }
  }
}

// The table has one entry for each check.
TEST(CheckTable, SaysWhatEachFailureMeans) {
  std::vector<std::string> names;
  for (const CheckInfo& info : ListChecks()) {
    names.emplace_back(info.name);
    EXPECT_EQ(FindCheck(info.name), &info);
    EXPECT_NE(*info.description, '\0') << info.name;
    const FailureMeaning& meaning = info.meaning;
    EXPECT_TRUE(!meaning.is_own || meaning.cause != Cause::kNone) << info.name;
    EXPECT_TRUE(meaning.sharper.empty() || (meaning.is_own && FindCheck(meaning.sharper) != nullptr))
        << info.name;
    EXPECT_NE(info.by.make == nullptr, info.by.evaluate == nullptr) << info.name;
  }
  for (const Step& step : kSteps) EXPECT_NE(FindCheck(step.name), nullptr) << step.name;
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_EQ(FindCheck("M_bar"), nullptr);
}

}  // namespace
}  // namespace dexcheck::testing::attribution_test

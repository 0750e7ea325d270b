// Plans of contacts, each checked by independent routes: forward kinematics of the robot's terms, contacts
// found by geometry, the grasp map of the contact model.

#include "controller/grasp/contact_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/force_closure.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"

namespace dexcheck::testing::contact_plan_test {
namespace {

// Fingertips rest within 1e-14 m, coordinates of a metre round at 1e-16.
constexpr double kTouchTolerance = 1e-13;
// The arm's search ends at 1e-12.
constexpr double kPalmTolerance = 1e-11;
// What a search may leave open: CalcForceClosure's default tolerance, both ways.
constexpr double kMarginTolerance = 0.03;

const Torus& GetTorus() {
  static const Torus torus(0.035, 0.011);
  return torus;
}

class ContactPlanTest : public ::testing::Test {
 protected:
  [[nodiscard]] Hand MakeHand(char side) const {
    Hand hand;
    for (const int tip : model_.fingertips()) {
      if (model_.frame(tip).name.front() == side) hand.fingertips.push_back(tip);
    }
    hand.palm_frame = model_.FindFrame(side + std::string("_palm_frame"));
    hand.arm_joints = ListArmJoints(model_, hand.fingertips, hand.palm_frame);
    return hand;
  }

  /// Elbows bent as in the shipped scenarios.
  [[nodiscard]] VectorXd MakeNominal() const {
    VectorXd q = VectorXd::Zero(model_.num_positions());
    for (const char* side : {"r", "l"}) {
      q[3 + model_.FindJoint(side + std::string("_elbow"))] = DegToRad(85.0);
      q[3 + model_.FindJoint(side + std::string("_shoulder_pitch"))] = DegToRad(10.0);
    }
    return q;
  }

  static Pose MakePose(const Vector3d& p, const Vector3d& axis = Vector3d::UnitZ(), double angle = 0.0) {
    Pose X = Pose::Identity();
    X.translation() = p;
    X.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    return X;
  }

  /// Margin of contacts by contact geometry and grasp map.
  static ForceClosureResult CalcMargin(const Surface& object, const std::vector<SurfacePoint>& points,
                                       double mu) {
    const Sphere tip(0.009);
    std::vector<Contact> contacts;
    for (const SurfacePoint& point : points) {
      contacts.push_back({.geometry = CalcContactGeometry(tip, object, {{0.3, 0.2, 0}, point, 0.7})});
    }
    Matrix6Xd G(6, 3 * contacts.size());
    CalcGraspMap(contacts, G);
    return CalcForceClosure(G, VectorXd::Constant(static_cast<Eigen::Index>(points.size()), mu));
  }

  /// Everything that a plan promises.
  void Check(const Hand& hand, const Surface& object, const Pose& X_Bo, const VectorXd& q_nominal,
             const ContactPlanOptions& options, const ContactPlan& plan) const {
    ASSERT_TRUE(plan.found) << plan.problem;
    EXPECT_EQ(plan.problem, "");
    ASSERT_EQ(plan.contacts.size(), hand.fingertips.size());
    ModelTerms terms(model_);
    ModelTerms open(model_);
    terms.SetState(plan.q, VectorXd::Zero(terms.size()));
    open.SetState(plan.q_open, VectorXd::Zero(terms.size()));
    EXPECT_TRUE(MatrixNear((X_Bo.inverse() * terms.CalcFramePose(hand.palm_frame)).matrix(),
                           plan.X_oP.matrix(), kPalmTolerance));

    // Joints: own ranges, and nothing else has moved.
    std::vector<int> moved = hand.arm_joints;
    for (const int tip : hand.fingertips) {
      int joint = model_.frame(tip).link;
      for (int k = 0; k < 4; ++k, joint = model_.joint(joint).parent) moved.push_back(joint);
    }
    double joint_margin = 1e9;
    VectorXd q = q_nominal;
    for (const int index : moved) {
      const Joint& joint = model_.joint(index);
      q[3 + index] = plan.q[3 + index];
      joint_margin = std::min({joint_margin, q[3 + index] - joint.lower, joint.upper - q[3 + index]});
    }
    EXPECT_EQ(q, plan.q);
    EXPECT_NEAR(joint_margin, plan.joint_margin, 1e-9);
    EXPECT_GE(plan.joint_margin, options.joint_margin - 1e-9);

    // Fingertips: touching at the contacts, open by the normals, apart, above the support.
    std::vector<Vector3d> centers;
    for (size_t i = 0; i < hand.fingertips.size(); ++i) {
      const double r = *model_.frame(hand.fingertips[i]).sphere_radius;
      const SurfaceGeometry surface = object.Evaluate(plan.contacts[i]);
      const Vector3d n = surface.R.col(2);
      const Vector3d center = X_Bo.inverse() * terms.CalcFramePose(hand.fingertips[i]).translation();
      EXPECT_TRUE(MatrixNear(center, surface.p + r * n, kTouchTolerance));
      const Vector3d opened = X_Bo.inverse() * open.CalcFramePose(hand.fingertips[i]).translation();
      EXPECT_TRUE(MatrixNear(opened, surface.p + (r + options.opening) * n, kTouchTolerance));
      EXPECT_NEAR(object.Project(opened).distance, r + options.opening, kTouchTolerance);
      for (const Vector3d& other : centers) EXPECT_GE((center - other).norm(), 2.0 * r + options.spacing);
      centers.push_back(center);
      EXPECT_LE(std::abs(surface.p.z()), options.half_length);
      if (options.support) {
        for (const Vector3d& p : {center, opened}) {
          const double height = options.support->normal.dot(X_Bo * p) - options.support->height;
          EXPECT_GE(height, r + options.clearance - 1e-9);
        }
        EXPECT_LE(std::abs(options.support->normal.dot(X_Bo.linear() * n)),
                  std::sin(options.steepest) + 1e-9);
      }
      // The finger's other joints stay outside of the object.
      int joint = model_.frame(hand.fingertips[i]).link;
      for (int k = 0; k < 4; ++k, joint = model_.joint(joint).parent) {
        const Vector3d origin = X_Bo.inverse() * terms.CalcLinkPose(joint).translation();
        EXPECT_GE(object.Project(origin).distance, options.finger_thickness * r);
      }
    }

    const ForceClosureResult closure = CalcMargin(object, plan.contacts, options.mu);
    EXPECT_EQ(closure.status, ForceClosureStatus::kForceClosure);
    EXPECT_NEAR(closure.margin_lower, plan.margin, kMarginTolerance * plan.margin);
    EXPECT_GE(plan.margin, options.least_margin);
  }

  RobotModel model_ = ReadPaperRobot();
};

TEST_F(ContactPlanTest, HoldsTheTorusOfThePaperBetterThanHandPickedContacts) {
  const std::vector<SurfacePoint> hand_picked = {
      {DegToRad(125.0), 0.0}, {DegToRad(90.0), 0.0}, {DegToRad(55.0), 0.0}, {DegToRad(-90.0), 0.0}};
  for (const char side : {'r', 'l'}) {
    const Hand hand = MakeHand(side);
    const VectorXd nominal = MakeNominal();
    ModelTerms terms(model_);
    terms.SetState(nominal, VectorXd::Zero(terms.size()));
    const Pose X_Bo = terms.CalcFramePose(hand.palm_frame) * MakePose({0.0, 0.0, 0.12});
    for (const double mu : {0.3, 0.6}) {
      const ContactPlanOptions options{.mu = mu};
      const ContactPlan plan = PlanContacts(model_, hand, GetTorus(), X_Bo, nominal, options);
      Check(hand, GetTorus(), X_Bo, nominal, options, plan);
      const ForceClosureResult by_hand = CalcMargin(GetTorus(), hand_picked, mu);
      ASSERT_EQ(by_hand.status, ForceClosureStatus::kForceClosure);
      // Measured: twice as large.
      EXPECT_GT(plan.margin, 1.5 * by_hand.margin) << "side " << side << ", mu " << mu;
    }
  }
}

TEST_F(ContactPlanTest, FindsAGraspWhereverTheTorusLiesOnATable) {
  constexpr double kTable = 0.62;  // m
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int sample = 0; sample < 20; ++sample) {
    const double side = sample % 4 == 3 ? 1.0 : -1.0;  // mostly the right one
    const Hand hand = MakeHand(side > 0.0 ? 'l' : 'r');
    const Vector3d place(0.30 + 0.05 * unit(random), side * 0.50 + 0.05 * unit(random), kTable + 0.011);
    const Pose X_Bo = MakePose(place, Vector3d::UnitZ(), kPi * unit(random));
    ContactPlanOptions options;
    options.support = SupportPlane{Vector3d::UnitZ(), kTable};
    const ContactPlan plan = PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), options);
    SCOPED_TRACE("sample " + std::to_string(sample));
    Check(hand, GetTorus(), X_Bo, MakeNominal(), options, plan);
    EXPECT_GT(plan.margin, 0.1);
    // From above.
    EXPECT_LT((X_Bo.linear() * plan.X_oP.linear().col(2)).z(), -0.6);
  }
}

TEST_F(ContactPlanTest, TouchesWithinTheRimsOfHemispheres) {
  constexpr double kTable = 0.62;  // m
  const Pose X_Bo = MakePose({0.30, -0.50, kTable + 0.011}, Vector3d::UnitZ(), 0.3);
  ContactPlanOptions options;
  options.support = SupportPlane{Vector3d::UnitZ(), kTable};
  const Hand hand = MakeHand('r');
  /// Least distance of the plan's contacts from the rims around `pole`, m.
  const auto find_least = [&](const ContactPlan& plan, const Vector3d& pole) {
    ModelTerms terms(model_);
    terms.SetState(plan.q, VectorXd::Zero(terms.size()));
    double least = 1.0;
    for (size_t i = 0; i < hand.fingertips.size(); ++i) {
      const Pose X_of = X_Bo.inverse() * terms.CalcFramePose(hand.fingertips[i]);
      const SurfacePoint touch = FindContact(Sphere(0.009), GetTorus(), X_of).kappa.alpha_f;
      least = std::min(least, CalcRimDistance(0.009, pole, Sphere(0.009).Evaluate(touch).p));
    }
    return least;
  };
  const auto plan_with = [&](const Vector3d& pole) {
    ContactPlanOptions with_pole = options;
    with_pole.hemisphere = pole;
    return PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), with_pole);
  };
  const ContactPlan whole = PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), options);
  ASSERT_TRUE(whole.found) << whole.problem;
  // Wherever the hemispheres point, a plan stays within their rims, also where that of whole spheres does
  // not.
  int past = 0;
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Vector3d pole = sign * Vector3d::Unit(k);
      SCOPED_TRACE(pole.transpose());
      const ContactPlan within = plan_with(pole);
      if (!within.found) {
        EXPECT_THAT(within.problem, HasSubstr("within the rims of their hemispheres"));
        continue;
      }
      EXPECT_GE(find_least(within, pole), 0.0);
      if (find_least(whole, pole) < 0.0) ++past;
    }
  }
  EXPECT_GE(past, 2);
}

TEST_F(ContactPlanTest, ReachesOnFromWhereItHolds) {
  const Hand hand = MakeHand('r');
  VectorXd nominal = MakeNominal();
  nominal[3 + model_.FindJoint("waist_pitch")] = 0.4;
  ContactPlanOptions options;
  options.support = SupportPlane{Vector3d::UnitZ(), 0.58};
  options.reaches = {{0.0, 0.0, 0.08}, {0.0, 0.0, 0.15}};
  const Pose X_Bo = MakePose({0.28, -0.5, 0.591});
  const ContactPlan plan = PlanContacts(model_, hand, GetTorus(), X_Bo, nominal, options);
  Check(hand, GetTorus(), X_Bo, nominal, options, plan);
  options.reaches = {{0.0, 0.0, 1.0}};
  const ContactPlan high = PlanContacts(model_, hand, GetTorus(), X_Bo, nominal, options);
  EXPECT_FALSE(high.found);
  EXPECT_THAT(high.problem, HasSubstr("cannot make all the displacements"));
}

TEST_F(ContactPlanTest, HoldsOtherShapes) {
  const Hand hand = MakeHand('r');
  const Sphere sphere(0.03);
  const Cylinder cylinder(0.022);
  const Vector3d place(0.35, -0.25, 0.85);
  const ContactPlanOptions options{.mu = 0.6, .half_length = 0.06};
  for (const double angle : {0.0, 0.5, kPi / 2.0}) {
    SCOPED_TRACE(angle);
    const Pose X_Bo = MakePose(place, {1.0, 0.3, 0.2}, angle);
    for (const Surface* object :
         {static_cast<const Surface*>(&sphere), static_cast<const Surface*>(&cylinder)}) {
      const ContactPlan plan = PlanContacts(model_, hand, *object, X_Bo, MakeNominal(), options);
      Check(hand, *object, X_Bo, MakeNominal(), options, plan);
      EXPECT_GT(plan.margin, 0.1);
    }
  }
}

TEST_F(ContactPlanTest, HoldsWithThreeFingers) {
  Hand hand = MakeHand('r');
  hand.fingertips.erase(hand.fingertips.begin() + 1);
  const Pose X_Bo = MakePose({0.35, -0.25, 0.85});
  const ContactPlanOptions options{.mu = 0.6};
  const ContactPlan plan = PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), options);
  Check(hand, GetTorus(), X_Bo, MakeNominal(), options, plan);
}

TEST_F(ContactPlanTest, PlansTheSameTwice) {
  const Hand hand = MakeHand('r');
  const Pose X_Bo = MakePose({0.35, -0.25, 0.85}, {1.0, 2.0, 3.0}, 0.8);
  const ContactPlan first = PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), {});
  const ContactPlan second = PlanContacts(model_, hand, GetTorus(), X_Bo, MakeNominal(), {});
  ASSERT_TRUE(first.found);
  EXPECT_EQ(first.q, second.q);
  EXPECT_EQ(first.margin, second.margin);
}

TEST_F(ContactPlanTest, SaysWhyThereIsNone) {
  const Hand hand = MakeHand('r');
  const auto plan = [&](const Surface& object, const Vector3d& place, const ContactPlanOptions& options) {
    const ContactPlan result = PlanContacts(model_, hand, object, MakePose(place), MakeNominal(), options);
    EXPECT_FALSE(result.found);
    EXPECT_TRUE(result.contacts.empty());
    return result.problem;
  };
  const Vector3d place(0.30, -0.50, 0.631);
  EXPECT_THAT(plan(GetTorus(), {3.0, 0.0, 0.6}, {}),
              HasSubstr("the arm does not reach the object: the palm stays"));
  EXPECT_THAT(plan(GetTorus(), place, {.mu = 1e-3}), HasSubstr("no force closure with mu = 0.001"));
  EXPECT_THAT(plan(GetTorus(), place, {.least_margin = 0.9}), HasSubstr("less than 0.9"));
  EXPECT_THAT(plan(Sphere(0.15), place, {}), HasSubstr("the palm finds no place beside the object"));
  EXPECT_THAT(plan(GetTorus(), place, {.opening = 0.1}), HasSubstr("not all fingertips find a place"));
  ContactPlanOptions high;
  high.support = SupportPlane{Vector3d::UnitZ(), place.z() + 0.03};
  EXPECT_THAT(plan(GetTorus(), place, high), HasSubstr("not all fingertips find a place"));
  high.support->height = place.z() + 1.0;
  EXPECT_THAT(plan(GetTorus(), place, high), HasSubstr("the palm finds no place beside the object"));
}

TEST_F(ContactPlanTest, RejectsWhatCannotBeUsed) {
  const auto plan = [&](const Hand& hand, const ContactPlanOptions& options) {
    return [=, this] {
      PlanContacts(model_, hand, GetTorus(), MakePose({0.3, -0.5, 0.6}), MakeNominal(), options);
    };
  };
  const auto rejects = [](const std::string& text) {
    return ThrowsMessage<std::invalid_argument>(HasSubstr(text));
  };
  const Hand hand = MakeHand('r');
  Hand two = hand;
  two.fingertips.resize(2);
  EXPECT_THAT(plan(two, {}), rejects("fingertips: must be at least three"));
  Hand both = hand;
  both.fingertips.back() = MakeHand('l').fingertips.back();
  EXPECT_THAT(plan(both, {}), rejects("does not hang on the palm"));
  Hand other_arm = hand;
  other_arm.arm_joints = MakeHand('l').arm_joints;
  EXPECT_THAT(plan(other_arm, {}), rejects("each must move frame r_palm_frame"));
  EXPECT_THAT(plan(hand, {.mu = 0.0}), rejects("mu: must be positive, got 0"));
  EXPECT_THAT(plan(hand, {.joint_margin = 0.6}), rejects("joint_margin: must leave each joint a range"));
  EXPECT_THAT(plan(hand, {.steepest = 2.0}), rejects("steepest"));
  ContactPlanOptions options;
  options.support = SupportPlane{Vector3d(0.0, 0.0, 2.0), 0.0};
  EXPECT_THAT(plan(hand, options), rejects("support: must have a unit normal, got 2"));
}

}  // namespace
}  // namespace dexcheck::testing::contact_plan_test

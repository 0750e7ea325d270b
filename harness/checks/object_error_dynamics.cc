#include "harness/checks/object_error_dynamics.h"

#include <cmath>

#include "controller/object/euler_zyz.h"
#include "controller/object/so3.h"
#include "harness/checks/step_analysis.h"

namespace dexcheck {
namespace {

/// Between two orientations, rad; good to rounding where it is small.
double CalcAngle(const Matrix3d& a, const Matrix3d& b) {
  const Matrix3d D = a.transpose() * b;
  const Vector3d twice_sine(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1));
  return std::atan2(0.5 * twice_sine.norm(), 0.5 * (D.trace() - 1.0));
}

/// Distance and angle.
void CalcApart(const Pose& a, const Pose& b, double* position, double* orientation) {
  *position = (a.translation() - b.translation()).norm();
  *orientation = CalcAngle(a.linear(), b.linear());
}

}  // namespace

void ObjectErrorDynamics::UpdateAngles(LawObject* object) const {
  if (spec_.orientation == OrientationFeedback::kAngles)
    object->X_o = CalcObjectCoordinates(object->X_Bo, object->X_o);
}

void ObjectErrorDynamics::Follow(const StepRecord& step, const LawTerms& terms, const DesiredMotion& desired,
                                 const Vector6d* predicted, LawReference* law, LawErrors* errors) {
  // The true object, which the law's terms need not be at.
  LawObject truth{terms.X_Bo, terms.V_Bo, terms.X_o};
  if (predicted == nullptr) {
    truth = {step.reading.state.X_Bo, step.reading.state.V_Bo, terms.X_o};
    UpdateAngles(&truth);
  }
  if (!has_begun_) {
    followed_.object = undisturbed_.object = held_.object = truth;
    has_begun_ = true;
  } else if (accelerates_within_step()) {
    FollowHeld(truth, desired, law);
  } else {
    Move(Vector6d::Zero(), &followed_);
    Move(Vector6d::Zero(), &undisturbed_);
  }
  before_ = {truth, step.response.V_Bo_dot};
  CalcApart(followed_.object.X_Bo, truth.X_Bo, &errors->error_dynamics, &errors->orientation_dynamics);
  CalcApart(undisturbed_.object.X_Bo, CalcObjectPose(desired.X_d), &errors->position_by_law,
            &errors->orientation_by_law);
  if (accelerates_within_step())
    CalcApart(held_.object.X_Bo, undisturbed_.object.X_Bo, &errors->position_by_hold,
              &errors->orientation_by_hold);
  for (Followed* one : {accelerates_within_step() ? &held_ : &followed_, &undisturbed_}) {
    UpdateAngles(&one->object);
    one->V_dot = law->CalcDemand(spec_, one->object, desired);
  }
  // What the plant's object did beyond the rigid prediction.
  followed_.V_dot +=
      step.response.V_Bo_dot - (predicted == nullptr ? law->CalcDemand(spec_, truth, desired) : *predicted);
}

void ObjectErrorDynamics::FollowHeld(const LawObject& truth, const DesiredMotion& desired,
                                     LawReference* law) {
  // (57) itself does not stand still within a step: Heun's method.
  Followed end = undisturbed_;
  Move(Vector6d::Zero(), &end);
  UpdateAngles(&end.object);
  end.V_dot = law->CalcDemand(spec_, end.object, desired);
  Move(0.5 * (CalcWorldAcceleration(end) - CalcWorldAcceleration(undisturbed_)), &undisturbed_);
  // Mean acceleration of the plant, less that of the step's beginning.
  const LawObject& from = before_.object;
  Vector6d change = truth.V_Bo - from.V_Bo;
  change.head<3>() = truth.X_Bo.linear() * truth.V_Bo.head<3>() - from.X_Bo.linear() * from.V_Bo.head<3>();
  Move(change / time_step_ - CalcWorldAcceleration(before_), &held_);
}

Vector6d ObjectErrorDynamics::CalcWorldAcceleration(const Followed& one) {
  // v = R^T p_dot, hence p_ddot = R (v_dot + omega x v).
  Vector6d acceleration = one.V_dot;
  acceleration.head<3>() += one.object.V_Bo.tail<3>().cross(one.object.V_Bo.head<3>());
  acceleration.head<3>() = one.object.X_Bo.linear() * acceleration.head<3>().eval();
  return acceleration;
}

void ObjectErrorDynamics::Move(const Vector6d& change, Followed* one) const {
  const Vector6d& V_dot = one->V_dot;
  LawObject* const object = &one->object;
  Matrix3d R = object->X_Bo.linear();
  const Vector3d v = object->V_Bo.head<3>();
  Vector3d omega = object->V_Bo.tail<3>();
  const Vector3d p_ddot = V_dot.head<3>() + omega.cross(v);
  const Vector3d p_dot = R * (v + time_step_ * p_ddot) + time_step_ * change.head<3>();
  omega += time_step_ * (V_dot.tail<3>() + change.tail<3>());
  // Velocities v_0 + dt (a + c) of positions x_0 + dt v_0 + dt^2 (a / 2 + c / 3), where the acceleration
  // goes from a to a + 2 c; by Euler's method c is zero and positions go by the new velocity.
  const double before = 0.5 * time_step_ - velocity_age_;
  constexpr double kFraction = 4.0 / 3.0;
  object->X_Bo.translation() += time_step_ * (p_dot - before * (R * p_ddot + kFraction * change.head<3>()));
  R = R * ExpSo3(time_step_ * (omega - before * (V_dot.tail<3>() + kFraction * change.tail<3>())));
  object->X_Bo.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  object->V_Bo << object->X_Bo.linear().transpose() * p_dot, omega;
}

}  // namespace dexcheck

#include "harness/view/frame_source.h"

namespace dexcheck {

RecordedFrameSource::RecordedFrameSource(const std::filesystem::path& run_dir)
    : run_(ReadRecordedFrames(run_dir)), checks_(run_.frames) {}

ViewFrame RecordedFrameSource::Read(long row) const {
  const RunFrames& all = run_.frames;
  const auto at = static_cast<size_t>(row);
  ViewFrame view;
  RunFrames& one = view.frame;
  one.source = all.source;
  one.title = all.title;
  one.object_body = all.object_body;
  one.friction = all.friction;
  const auto take = [&](const RowMatrixXd& from, RowMatrixXd* to) {
    if (from.size() > 0) *to = from.row(row);
  };
  const auto take_number = [&](const std::vector<double>& from, std::vector<double>* to) {
    if (!from.empty()) *to = {from[at]};
  };
  one.times = {all.times[at]};
  take(all.qpos, &one.qpos);
  if (!all.phases.empty()) one.phases = {all.phases[at]};
  take_number(all.position_errors, &one.position_errors);
  take_number(all.orientation_errors, &one.orientation_errors);
  take_number(all.joint_errors, &one.joint_errors);
  take(all.contact_positions, &one.contact_positions);
  take(all.contact_forces, &one.contact_forces);
  take(all.contact_normals, &one.contact_normals);
  take(all.desired_positions, &one.desired_positions);
  view.categories = checks_.ListCategories(row);
  return view;
}

}  // namespace dexcheck

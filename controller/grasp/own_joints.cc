#include "controller/grasp/own_joints.h"

#include <algorithm>
#include <stdexcept>

namespace dexcheck::grasp_internal {

std::vector<int> ListChain(const RobotModel& model, int frame) {
  std::vector<int> chain;
  int joint = model.frames().at(static_cast<size_t>(frame)).link;
  for (; joint >= 0; joint = model.joints()[static_cast<size_t>(joint)].parent) chain.push_back(joint);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

std::vector<std::vector<int>> ListOwnJoints(const RobotModel& model, std::span<const int> fingertips) {
  std::vector<int> users(static_cast<size_t>(model.num_joints()), 0);
  for (const int frame : fingertips) {
    for (const int joint : ListChain(model, frame)) ++users[static_cast<size_t>(joint)];
  }
  std::vector<std::vector<int>> own(fingertips.size());
  for (size_t i = 0; i < fingertips.size(); ++i) {
    std::vector<int> chain = ListChain(model, fingertips[i]);
    std::reverse(chain.begin(), chain.end());
    for (const int joint : chain) {
      if (users[static_cast<size_t>(joint)] == 1) own[i].push_back(joint);
    }
    if (own[i].empty()) throw std::invalid_argument("fingertips: a finger has no joints of its own");
  }
  return own;
}

}  // namespace dexcheck::grasp_internal

#pragma once

// Results as continuous-integration servers read them.

#include <string>
#include <vector>

#include "harness/base/check_record.h"

namespace dexcheck::cli {

/// One check as a test case.
struct JUnitCase {
  std::string group;    ///< "constant", "term", "inverse_dynamics": its class.
  std::string name;     ///< "M_bar"
  std::string failure;  ///< What is wrong, in one or more lines; empty when nothing is.
  std::string output;   ///< What is worth knowing anyway.
};

/// A check that has run, as a test case. @param where the worst number belongs to.
JUnitCase MakeJUnitCase(const std::string& group, const CheckRecord& record, const std::string& where);

/// The cases of one command as a JUnit XML document. An error is what kept the command from its end.
std::string WriteJUnit(const std::string& suite, const std::vector<JUnitCase>& cases, double seconds,
                       const std::string& error = "");

}  // namespace dexcheck::cli

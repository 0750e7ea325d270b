#pragma once

#include <gtest/gtest.h>

#include <string>

#include "harness/checks/consistency.h"

namespace dexcheck::testing {

/// The names of the checks that failed, each followed by a space. All terms must have been compared.
inline std::string ListFailures(const ConsistencyResult& result) {
  EXPECT_GE(result.terms.size(), 11U);  // as many has a body that floats alone
  std::string failures;
  for (const auto* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.failed) failures += record.name + " ";
    }
  }
  return failures;
}

}  // namespace dexcheck::testing

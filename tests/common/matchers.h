#pragma once

// GoogleMock's matchers under the names that the tests' own have.

#include <gmock/gmock.h>

namespace dexcheck::testing {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

}  // namespace dexcheck::testing

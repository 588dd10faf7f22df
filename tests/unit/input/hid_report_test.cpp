// Finds a joystick's axis by its descriptor.
#include "common/input/hid_report.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace osteon {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Two buttons and six bits of padding, x of 8 bits signed, then report 2 with z of 10 bits from 0 and a throttle of 16.
const Bytes kDescriptor{0x05, 0x01, 0x09, 0x04, 0xa1, 0x01, 0x85, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x02, 0x15,
                        0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x02, 0x81, 0x02, 0x95, 0x06, 0x81, 0x03, 0x05, 0x01,
                        0x09, 0x30, 0x15, 0x81, 0x25, 0x7f, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02, 0x85, 0x02, 0x09,
                        0x32, 0x15, 0x00, 0x26, 0xff, 0x03, 0x75, 0x0a, 0x81, 0x02, 0x75, 0x06, 0x81, 0x03, 0x05,
                        0x02, 0x09, 0xbb, 0x27, 0xff, 0xff, 0x00, 0x00, 0x75, 0x10, 0x81, 0x02, 0xc0};

TEST(HidReport, FieldsLieWhereTheDescriptorSays) {
  const std::vector<HidField> fields = hid_input_fields(kDescriptor);
  ASSERT_EQ(fields.size(), 5u);  // two buttons, x, z, throttle; nothing for the padding
  EXPECT_EQ(fields[1].page, 9);
  EXPECT_EQ(fields[1].usage, 2);
  EXPECT_EQ(fields[1].bit, 1u);
  const HidUsage x{1, 0x30}, z{1, 0x32}, throttle{2, 0xbb}, none{1, 0x35};
  const auto fx = find_field(fields, {&x, 1}), fz = find_field(fields, {&z, 1}),
             ft = find_field(fields, {&throttle, 1});
  ASSERT_TRUE(fx && fz && ft);
  EXPECT_FALSE(find_field(fields, {&none, 1}));
  EXPECT_EQ(fx->report, 1);
  EXPECT_EQ(fx->bit, 8u);
  EXPECT_EQ(fz->report, 2);
  EXPECT_EQ(fz->bit, 0u);
  EXPECT_EQ(ft->bit, 16u);
  EXPECT_EQ(ft->highest, 65535);

  EXPECT_EQ(fx->value(Bytes{1, 0, 0x81}), -127);
  EXPECT_DOUBLE_EQ(fx->share(Bytes{1, 3, 0x81}).value(), 0.0);
  EXPECT_DOUBLE_EQ(fx->share(Bytes{1, 3, 0x7f}).value(), 1.0);
  EXPECT_EQ(fz->value(Bytes{2, 0x34, 0xfe, 0, 0}), 0x234);
  EXPECT_EQ(ft->value(Bytes{2, 0, 0, 0x34, 0xf2}), 0xf234);
  EXPECT_FALSE(fx->value(Bytes{2, 0, 0x81}));  // another report
  EXPECT_FALSE(fz->value(Bytes{2, 0x34}));     // too short
}

TEST(HidReport, AnUnsignedByteRangeIsNotMinusOne) {
  // 25 ff means −1 where 255 is intended, as in many devices.
  const Bytes descriptor{0x05, 0x01, 0x09, 0x30, 0x15, 0x00, 0x25, 0xff, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02};
  const std::vector<HidField> fields = hid_input_fields(descriptor);
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields[0].highest, 255);
  EXPECT_DOUBLE_EQ(fields[0].share(Bytes{51}).value(), 0.2);
}

TEST(HidReport, DamagedDescriptorsEndQuietly) {
  for (std::size_t cut = 0; cut < kDescriptor.size(); ++cut) {
    const std::vector<HidField> fields = hid_input_fields(std::span(kDescriptor).first(cut));
    EXPECT_LE(fields.size(), 5u);
  }
  EXPECT_TRUE(hid_input_fields(Bytes{0xb4, 0x81, 0x02}).empty());  // pop of nothing
  EXPECT_TRUE(hid_input_fields(Bytes{0x97, 0xff, 0xff, 0xff, 0xff, 0x75, 0x08, 0x09, 0x30, 0x81, 0x02})
                  .empty());  // four thousand million fields
}

}  // namespace
}  // namespace osteon

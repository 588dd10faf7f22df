// The pictures of reports, as common/picture draws them.
#pragma once
#include "common/picture/picture.hpp"

namespace osteon::import {

using picture::Colour;
using picture::kBlackInk;
using picture::kGreyInk;
using picture::kTextHeight;
using picture::kWhiteInk;
using picture::mixed;
using picture::Picture;
using picture::text_width;

}  // namespace osteon::import

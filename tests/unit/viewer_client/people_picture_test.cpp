// Checks in the pixels what people draw and say. Checks the mouse with events as an X server sends them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "picture.hpp"
#include "synthetic.hpp"
#include "viewer_client/scene/stroke.hpp"
// Last, because it defines macros with words that others use as names.
#include <X11/Xlib.h>
#include <X11/keysym.h>

namespace osteon {
namespace {

using test::differing_pixels;
using test::focal_px;
using test::from_front;
using test::kHeight;
using test::kWidth;

constexpr RegionKey kHere{BodyId{0}, 0, {0, 0, 0}};
constexpr double kRadius_mm = 15.0, kFrom_mm = 100.0;
constexpr std::uint32_t kGreen = 0x10e040;

bool greenish(const Vec3& colour) { return colour.y() > 1.25 * colour.x() && colour.y() > 1.25 * colour.z(); }

Annotation mark(std::uint32_t id, AnnotationKind kind, const std::vector<Vec3>& points_mm,
                const std::string& words = {}) {
  Annotation one{.id = id, .author = AuthorId{3}, .kind = kind, .words = words, .colour = kGreen};
  for (const Vec3& point : points_mm) one.points.push_back(in_steps(point));
  return one;
}

class PeoplePicture : public test::Picture {
 protected:
  void SetUp() override {
    test::Picture::SetUp();
    if (!window_) return;
    window_->show_region(kHere, test::sphere_mesh(Vec3::Zero(), kRadius_mm, 0));
    bare_ = drawn_now();
  }
  Image drawn_now() { return test::Picture::drawn(); }
  Image with(const std::vector<Annotation>& all) {
    window_->show_annotations(all);
    return drawn_now();
  }
  // Where a point of the bone appears from the front: column and row.
  static std::pair<int, int> seen(const Vec3& p) {
    const double px_per_mm = focal_px(from_front(kFrom_mm)) / (kFrom_mm + p.y());
    const auto x = std::lround(0.5 * kWidth + px_per_mm * p.x()), y = std::lround(0.5 * kHeight - px_per_mm * p.z());
    return {static_cast<int>(x), static_cast<int>(y)};
  }
  static Vec3 at(const Image& image, const Vec3& p) {
    const auto [x, y] = seen(p);
    return colour(image, x, y);
  }
  static int green_pixels(const Image& image) {
    return static_cast<int>(
        std::ranges::count_if(image.rgb, [](const auto& c) { return greenish(Vec3(c[0], c[1], c[2])); }));
  }

  // Pixels of a line that is not finished.
  static int yellow_pixels(const Image& image) {
    const auto yellow = [](const auto& c) { return c[0] > 120 && c[1] > 2 * c[2] && c[0] > c[1]; };
    return static_cast<int>(std::ranges::count_if(image.rgb, yellow));
  }

  Image bare_;
};

// A point on the sphere's front, at these angles to the right and up.
Vec3 on_front(double right_rad, double up_rad) {
  return kRadius_mm *
         Vec3(std::sin(right_rad) * std::cos(up_rad), -std::cos(right_rad) * std::cos(up_rad), std::sin(up_rad));
}

TEST_F(PeoplePicture, ALineIsSeenInItsColourAlongItsPointsAndVanishes) {
  std::vector<Vec3> points;
  for (int i = -10; i <= 10; ++i) points.push_back(on_front(0.06 * i, 0.0));
  const Image image = with({mark(1, AnnotationKind::line, points)});
  for (const int i : {-9, -4, 0, 5, 9}) EXPECT_TRUE(greenish(at(image, on_front(0.06 * i, 0.0)))) << i;
  // Above and below it the bone looks as before.
  for (const double off : {0.3, -0.3}) EXPECT_EQ(at(image, on_front(0.0, off)), at(bare_, on_front(0.0, off)));
  EXPECT_EQ(differing_pixels(with({}), bare_), 0);
}

TEST_F(PeoplePicture, WhatLiesBehindTheBoneShowsThroughItALittle) {
  const auto line_at = [](double y) { return mark(1, AnnotationKind::line, {{-5, y, 0}, {5, y, 0}}); };
  const double in_front_mm = -kRadius_mm - 1.0, behind_mm = 40.0;
  const Vec3 before = at(with({line_at(in_front_mm)}), {0, in_front_mm, 0}),
             behind = at(with({line_at(behind_mm)}), {0, behind_mm, 0});
  const Vec3 bone = at(bare_, Vec3::Zero());
  EXPECT_GT((behind - bone).norm(), 10.0);
  EXPECT_LT((behind - bone).norm(), 0.5 * (before - bone).norm());
}

TEST_F(PeoplePicture, AnArrowEndsAtItsPointAndComesFromOutside) {
  const Vec3 point = on_front(0.9, 0.0);  // on the right
  const Image image = with({mark(4, AnnotationKind::pointer, {point})});
  const auto [x, y] = seen(point);
  int left = 0, right = 0, near = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const auto& c = image.at(column, row);
      if (!greenish(Vec3(c[0], c[1], c[2]))) continue;
      (column < x - 6 ? left : right) += 1;
      near += std::hypot(column - x, row - y) < 6.0 ? 1 : 0;
    }
  EXPECT_GT(near, 5);
  EXPECT_GT(right, 150) << "the shaft, out of the bone";
  EXPECT_EQ(left, 0);
  EXPECT_EQ(differing_pixels(with({}), bare_), 0);
}

TEST_F(PeoplePicture, AnArrowIsAsLongOnTheScreenFromFarAway) {
  const std::vector<Annotation> arrow{mark(4, AnnotationKind::pointer, {on_front(0.9, 0.0)})};
  const int near = green_pixels(with(arrow));
  window_->look(from_front(5.0 * kFrom_mm));
  const int far = green_pixels(drawn_now());
  EXPECT_GT(far, near / 2);
  EXPECT_LT(far, 2 * near);
}

TEST_F(PeoplePicture, ALabelSaysItsWordsBesideItsDot) {
  const Vec3 point = on_front(-0.4, 0.3);
  const Image dot = with({mark(2, AnnotationKind::label, {point}, "a")});
  const Image words = with({mark(2, AnnotationKind::label, {point}, "a nerve")});
  EXPECT_TRUE(greenish(at(dot, point)));
  EXPECT_TRUE(greenish(at(words, point)));
  const auto [x, y] = seen(point);
  int beyond = 0, elsewhere = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      if (dot.at(column, row) == words.at(column, row)) continue;
      (column > x && std::abs(row - y) < 24 ? beyond : elsewhere) += 1;
    }
  EXPECT_GT(beyond, 200) << "the longer words";
  EXPECT_EQ(elsewhere, 0);
}

TEST_F(PeoplePicture, TwoLabelsAtOnePlaceDoNotCoverEachOther) {
  const Vec3 point = on_front(0.0, 0.2);
  const Annotation first = mark(2, AnnotationKind::label, {point}, "first"),
                   same = mark(3, AnnotationKind::label, {point}, "first");
  const int one = green_pixels(with({first})), two = green_pixels(with({first, same}));
  const int other = green_pixels(with({first, mark(3, AnnotationKind::label, {on_front(0.0, -0.6)}, "first")}));
  EXPECT_GT(two, 1.3 * one) << "the second frame is visible too";
  EXPECT_GT(two, 0.8 * other - 60);
}

TEST_F(PeoplePicture, AToolIsNamedByItsPerson) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3(0, -20, 0), -Vec3::UnitZ());
  const Image before = with({mark(1, AnnotationKind::label, {on_front(-0.5, -0.5)}, "x")});
  window_->show_tools(std::span(&state, 1));
  const Image nameless = drawn_now();
  window_->show_names({{AuthorId{8}, "somebody else"}});
  EXPECT_EQ(differing_pixels(drawn_now(), nameless), 0);
  window_->show_names({{AuthorId{7}, "Ada"}});
  EXPECT_GT(differing_pixels(drawn_now(), nameless), 100);
  window_->show_tools({});
  EXPECT_EQ(differing_pixels(drawn_now(), before), 0);
}

TEST_F(PeoplePicture, WordsStandBelowAndWhatHoldsAbove) {
  const auto changed_rows = [&](const Image& image) {
    std::pair<int, int> rows{kHeight, -1};
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column)
        if (image.at(column, row) != bare_.at(column, row))
          rows = {std::min(rows.first, row), std::max(rows.second, row)};
    return rows;
  };
  window_->show_words({"Ada: done", "Dr. Berg: thank you"}, "");
  const auto said = changed_rows(drawn_now());
  EXPECT_GT(said.first, kHeight / 2);
  EXPECT_GT(said.second - said.first, 30) << "two lines";
  window_->show_words({}, "Your hand is stopped");
  const auto holding = changed_rows(drawn_now());
  EXPECT_LT(holding.second, kHeight / 2);
  EXPECT_GE(holding.second, holding.first);
  window_->show_words({}, "");
  EXPECT_EQ(differing_pixels(drawn_now(), bare_), 0);
}

TEST_F(PeoplePicture, TheSurfaceUnderAPixelIsTheBonesNotTheTools) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3(0, -20, 0), -Vec3::UnitZ());
  window_->show_tools(std::span(&state, 1));
  (void)drawn_now();
  for (const Vec3& point : {on_front(0.0, 0.0), on_front(0.5, 0.4), on_front(-0.6, -0.3)}) {
    const auto [x, y] = seen(point);
    const auto at = window_->surface_at(x, y);
    ASSERT_TRUE(at);
    // A pixel is 0.2 mm here. Facets lie up to 0.1 mm inside the sphere, more where the view is along the surface.
    EXPECT_LT((*at - point).norm(), 0.6) << at->transpose();
    EXPECT_NEAR(at->norm(), kRadius_mm, 0.1);
  }
  EXPECT_FALSE(window_->surface_at(3, 3));
}

// Keyboard and mouse of a person at the viewer.
class Drawing : public PeoplePicture {
 protected:
  void SetUp() override {
    PeoplePicture::SetUp();
    display_ = XOpenDisplay(screen_->display().c_str());
    ASSERT_NE(display_, nullptr);
    ::Window root = 0, parent = 0, *children = nullptr;
    unsigned count = 0;
    ASSERT_NE(XQueryTree(display_, DefaultRootWindow(display_), &root, &parent, &children, &count), 0);
    for (unsigned i = 0; i < count; ++i) {
      XWindowAttributes attributes;
      if (XGetWindowAttributes(display_, children[i], &attributes) == 0) continue;
      if (attributes.width == kWidth && attributes.height == kHeight) shown_ = children[i];
    }
    XFree(children);
    ASSERT_NE(shown_, 0u);
    (void)window_->events();
  }
  void TearDown() override {
    if (display_ != nullptr) XCloseDisplay(display_);
    PeoplePicture::TearDown();
  }
  void send(XEvent event, long mask) {
    XSendEvent(display_, shown_, True, mask, &event);
    XSync(display_, False);
  }
  void press_key(KeySym key) {
    XEvent event{};
    event.xkey.type = KeyPress;
    event.xkey.display = display_;
    event.xkey.window = shown_;
    event.xkey.keycode = XKeysymToKeycode(display_, key);
    event.xkey.same_screen = True;
    send(event, KeyPressMask);
  }
  void button(int type, const Vec3& over) {
    const auto [x, y] = seen(over);
    XEvent event{};
    event.xbutton.type = type;
    event.xbutton.display = display_;
    event.xbutton.window = shown_;
    event.xbutton.button = Button1;
    event.xbutton.x = x;
    event.xbutton.y = y;
    event.xbutton.same_screen = True;
    send(event, type == ButtonPress ? ButtonPressMask : ButtonReleaseMask);
  }
  // VTK asks the server for the pointer's position, so the pointer must really be there.
  void move(const Vec3& over) {
    const auto [x, y] = seen(over);
    XWarpPointer(display_, 0, shown_, 0, 0, 0, 0, x, y);
    XSync(display_, False);
    moved_ = window_->events().redraw || moved_;
  }

  Display* display_ = nullptr;
  ::Window shown_ = 0;
  bool moved_ = false;
};

TEST_F(Drawing, APressesPThenClicksWhereToPoint) {
  press_key(XK_p);
  EXPECT_TRUE(window_->events().redraw);
  EXPECT_GT(differing_pixels(drawn_now(), bare_), 50) << "a hint is shown";
  button(ButtonPress, Vec3(40, 0, 0));  // beside the bone
  button(ButtonRelease, Vec3(40, 0, 0));
  EXPECT_FALSE(window_->events().pointed);
  const Vec3 point = on_front(0.3, -0.2);
  button(ButtonPress, point);
  button(ButtonRelease, point);
  const WindowEvents events = window_->events();
  ASSERT_TRUE(events.pointed);
  EXPECT_LT((*events.pointed - point).norm(), 0.6);
  EXPECT_EQ(differing_pixels(drawn_now(), bare_), 0) << "and the camera has not moved";
  // It works only once: the next click turns the bone again.
  button(ButtonPress, point);
  button(ButtonRelease, point);
  EXPECT_FALSE(window_->events().pointed);
}

TEST_F(Drawing, ALineFollowsTheMouseOverTheSurface) {
  press_key(XK_l);
  button(ButtonPress, on_front(-0.5, 0.0));
  for (int i = -49; i <= 50; ++i) move(on_front(0.01 * i, 0.0));
  EXPECT_TRUE(moved_);
  EXPECT_GT(yellow_pixels(drawn_now()), yellow_pixels(bare_) + 100) << "the line is visible while it is drawn";
  button(ButtonRelease, on_front(0.5, 0.0));
  const std::vector<Vec3> line = window_->events().drawn;
  ASSERT_GE(line.size(), 3u) << "it bends";
  EXPECT_LE(line.size(), 17u) << "15 mm, a point a millimetre at most";
  EXPECT_LT((line.front() - on_front(-0.5, 0.0)).norm(), 0.6);
  EXPECT_LT((line.back() - on_front(0.5, 0.0)).norm(), 0.6);
  for (const Vec3& point : line) EXPECT_NEAR(point.norm(), kRadius_mm, 0.1);
  EXPECT_EQ(differing_pixels(drawn_now(), bare_), 0);
  EXPECT_TRUE(window_->events().drawn.empty());
}

TEST_F(Drawing, EscapeLeavesItAndXWipes) {
  press_key(XK_l);
  button(ButtonPress, on_front(-0.5, 0.0));
  move(on_front(0.5, 0.0));
  press_key(XK_Escape);
  (void)window_->events();
  EXPECT_EQ(differing_pixels(drawn_now(), bare_), 0);
  button(ButtonRelease, on_front(0.5, 0.0));
  EXPECT_TRUE(window_->events().drawn.empty());
  EXPECT_FALSE(window_->events().wants_wipe);
  press_key(XK_x);
  EXPECT_TRUE(window_->events().wants_wipe);
}

}  // namespace
}  // namespace osteon

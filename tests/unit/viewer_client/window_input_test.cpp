// Checks keys and mouse with events as an X server sends them.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "picture.hpp"
// Last, because it defines macros with words that others use as names.
#include <X11/Xlib.h>
#include <X11/keysym.h>

namespace osteon {
namespace {

using test::differing_pixels;
using test::kHeight;
using test::kRadius_mm;
using test::kWidth;
using test::on_front;

// Keyboard and mouse of a person at the viewer.
class Drawing : public test::SpherePicture {
 protected:
  void SetUp() override {
    SpherePicture::SetUp();
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
    SpherePicture::TearDown();
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

  // Pixels of a line that is not finished.
  static int yellow_pixels(const Image& image) {
    const auto yellow = [](const auto& c) { return c[0] > 120 && c[1] > 2 * c[2] && c[0] > c[1]; };
    return static_cast<int>(std::ranges::count_if(image.rgb, yellow));
  }

  Display* display_ = nullptr;
  ::Window shown_ = 0;
  bool moved_ = false;
};

TEST_F(Drawing, APressesPThenClicksWhereToPoint) {
  press_key(XK_p);
  EXPECT_TRUE(window_->events().redraw);
  EXPECT_GT(differing_pixels(drawn(), bare_), 50) << "a hint is shown";
  button(ButtonPress, Vec3(40, 0, 0));  // beside the bone
  button(ButtonRelease, Vec3(40, 0, 0));
  EXPECT_FALSE(window_->events().pointed);
  const Vec3 point = on_front(0.3, -0.2);
  button(ButtonPress, point);
  button(ButtonRelease, point);
  const WindowEvents events = window_->events();
  ASSERT_TRUE(events.pointed);
  EXPECT_LT((*events.pointed - point).norm(), 0.6);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0) << "and the camera has not moved";
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
  EXPECT_GT(yellow_pixels(drawn()), yellow_pixels(bare_) + 100) << "the line is visible while it is drawn";
  button(ButtonRelease, on_front(0.5, 0.0));
  const std::vector<Vec3> line = window_->events().drawn;
  ASSERT_GE(line.size(), 3u) << "it bends";
  EXPECT_LE(line.size(), 17u) << "15 mm, a point a millimetre at most";
  EXPECT_LT((line.front() - on_front(-0.5, 0.0)).norm(), 0.6);
  EXPECT_LT((line.back() - on_front(0.5, 0.0)).norm(), 0.6);
  for (const Vec3& point : line) EXPECT_NEAR(point.norm(), kRadius_mm, 0.1);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
  EXPECT_TRUE(window_->events().drawn.empty());
}

TEST_F(Drawing, EscapeLeavesItAndXWipes) {
  press_key(XK_l);
  button(ButtonPress, on_front(-0.5, 0.0));
  move(on_front(0.5, 0.0));
  press_key(XK_Escape);
  (void)window_->events();
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
  button(ButtonRelease, on_front(0.5, 0.0));
  EXPECT_TRUE(window_->events().drawn.empty());
  EXPECT_FALSE(window_->events().wants_wipe);
  press_key(XK_x);
  EXPECT_TRUE(window_->events().wants_wipe);
}

}  // namespace
}  // namespace osteon

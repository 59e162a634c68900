import java.awt.Frame;
import java.awt.Point;
import java.awt.Rectangle;
import java.awt.Robot;
import java.awt.Toolkit;
import java.awt.event.InputEvent;
import java.awt.image.BufferedImage;
import java.io.File;
import java.lang.reflect.Array;
import java.lang.reflect.Field;
import java.lang.reflect.Modifier;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;
import java.util.concurrent.Callable;
import java.util.concurrent.FutureTask;
import java.util.concurrent.TimeUnit;
import javax.imageio.ImageIO;
import javax.swing.JFrame;
import javax.swing.JTable;
import javax.swing.SwingUtilities;
import lcm.spy.LCMTypeDatabase;
import lcm.spy.ObjectPanel;

/**
 * Looks at lcm-spy from inside its own process, as a Java agent: which types it knows, what its
 * window shows of each channel, and whether a double click opens a channel's decoded fields.
 * Ends lcm-spy with 0 when all is as expected, 1 otherwise; every line that it prints begins with
 * "probe: ". System properties: probe.types and probe.channels (NAME=type), comma-separated;
 * probe.last, a channel (likewise) that only speaks once the picture is there; probe.open, the
 * channel to open; probe.picture, the PNG file to write.
 */
public final class SpyProbe {
  private static final int CHANNEL = 0, TYPE = 1, MESSAGES = 2, UNDECODABLE = 7;
  private static final int ENOUGH = 20; // messages of a channel
  private static final long PATIENCE = 60_000; // ms

  public static void premain(String arguments) {
    // The variable that loads agents reaches every Java program, compilers too.
    if (!System.getProperty("sun.java.command", "").startsWith("lcm.spy.Spy")) return;
    Thread thread = new Thread(SpyProbe::run, "probe");
    thread.setDaemon(true);
    thread.start();
  }

  private static void run() {
    int code = 1;
    try {
      checkTypes();
      waitForChannels(pairs("probe.channels"), ENOUGH);
      openFields(System.getProperty("probe.open"));
      waitForChannels(pairs("probe.last"), 1);
      say("all as expected");
      code = 0;
    } catch (Throwable problem) {
      say("FAILED: " + problem.getMessage());
      if (!(problem instanceof Failure)) problem.printStackTrace();
    }
    Runtime.getRuntime().halt(code);
  }

  private static final class Failure extends RuntimeException {
    Failure(String message) {
      super(message);
    }
  }

  private static void say(String text) {
    System.out.println("probe: " + text);
    System.out.flush();
  }

  private static Map<String, String> pairs(String property) {
    Map<String, String> pairs = new TreeMap<>();
    for (String pair : System.getProperty(property).split(",")) {
      pairs.put(pair.split("=")[0], pair.split("=")[1]);
    }
    return pairs;
  }

  /** lcm-spy searches its class path for types; each must be found by its fingerprint. */
  private static void checkTypes() throws Exception {
    LCMTypeDatabase database = new LCMTypeDatabase();
    String[] types = System.getProperty("probe.types").split(",");
    for (String name : types) {
      Class<?> type = Class.forName("poise." + name);
      long fingerprint = type.getField("LCM_FINGERPRINT").getLong(null);
      if (database.getClassByFingerprint(fingerprint) != type) {
        throw new Failure("lcm-spy has not found the type " + name);
      }
    }
    say("found " + types.length + " types");
  }

  /** Waits until the window's table shows these channels, decoded. */
  private static void waitForChannels(Map<String, String> channels, int messages) throws Exception {
    long deadline = System.currentTimeMillis() + PATIENCE;
    String lacking = "the window";
    while (System.currentTimeMillis() < deadline) {
      lacking = onSwing(() -> lacking(channels, messages));
      if (lacking.isEmpty()) {
        say("received and decoded " + channels.size() + " channels");
        return;
      }
      Thread.sleep(100);
    }
    throw new Failure("lcm-spy does not show " + lacking);
  }

  private static String lacking(Map<String, String> channels, int messages) {
    JTable table = table();
    if (table == null) return "its window";
    List<String> lacking = new ArrayList<>();
    for (Map.Entry<String, String> channel : channels.entrySet()) {
      int row = rowOf(table, channel.getKey());
      if (row < 0) {
        lacking.add(channel.getKey());
        continue;
      }
      String type = text(table, row, TYPE);
      if (!type.equals(channel.getValue())) {
        throw new Failure(channel.getKey() + " is shown as a " + type);
      }
      if (Integer.parseInt(text(table, row, UNDECODABLE)) != 0) {
        throw new Failure(channel.getKey() + " has undecodable messages");
      }
      if (Integer.parseInt(text(table, row, MESSAGES)) < messages) lacking.add(channel.getKey());
    }
    return String.join(", ", lacking);
  }

  /** A real double click on the channel's row, as a user does it, then a picture of the screen. */
  private static void openFields(String channel) throws Exception {
    Robot robot = new Robot();
    robot.setAutoDelay(40);
    Point row = onSwing(() -> {
      JTable table = table();
      Rectangle cell = table.getCellRect(rowOf(table, channel), CHANNEL, true);
      Point origin = table.getLocationOnScreen();
      return new Point(origin.x + cell.x + 10, origin.y + cell.y + cell.height / 2);
    });
    robot.mouseMove(row.x, row.y);
    for (int click = 0; click < 2; ++click) {
      robot.mousePress(InputEvent.BUTTON1_DOWN_MASK);
      robot.mouseRelease(InputEvent.BUTTON1_DOWN_MASK);
    }
    long deadline = System.currentTimeMillis() + PATIENCE;
    Object message = null;
    while (message == null && System.currentTimeMillis() < deadline) {
      Thread.sleep(100);
      message = onSwing(() -> shownMessage(channel));
    }
    if (message == null) throw new Failure("a double click on " + channel + " opens no fields");
    checkArrays(message);
    onSwing(() -> {
      arrange(channel);
      return null;
    });
    Thread.sleep(2000); // for the sparklines to grow
    BufferedImage picture =
        robot.createScreenCapture(new Rectangle(Toolkit.getDefaultToolkit().getScreenSize()));
    String file = System.getProperty("probe.picture");
    ImageIO.write(picture, "png", new File(file));
    Files.writeString(Path.of(file + ".txt"), shown(channel, message));
    say("opened the fields of " + channel);
  }

  /** What the picture shows, a line each: the table's channels with their types, the open message's fields. */
  private static String shown(String channel, Object message) throws Exception {
    List<String> lines = onSwing(() -> {
      List<String> rows = new ArrayList<>();
      JTable table = table();
      for (int row = 0; row < table.getRowCount(); ++row) {
        String name = text(table, row, CHANNEL);
        // liblcm's own, of whoever starts meanwhile
        if (!name.equals("LCM_SELF_TEST")) rows.add(name + " " + text(table, row, TYPE));
      }
      return rows;
    });
    for (Field field : message.getClass().getFields()) {
      if (!Modifier.isStatic(field.getModifiers())) lines.add(channel + "." + field.getName());
    }
    Collections.sort(lines);
    return String.join("\n", lines);
  }

  /** Every array of the decoded message has elements: the counts were understood. */
  private static void checkArrays(Object message) throws Exception {
    for (Field field : message.getClass().getFields()) {
      Object value = field.get(message);
      if (value != null && value.getClass().isArray() && Array.getLength(value) == 0) {
        throw new Failure("the array " + field.getName() + " is shown empty");
      }
    }
  }

  private static Object shownMessage(String channel) {
    JFrame frame = frame(channel);
    ObjectPanel panel = frame == null ? null : find(frame, ObjectPanel.class);
    if (panel == null || !panel.isShowing()) return null;
    try {
      Field shown = ObjectPanel.class.getDeclaredField("o");
      shown.setAccessible(true);
      return shown.get(panel);
    } catch (ReflectiveOperationException problem) {
      throw new Failure("lcm-spy's panel has another form: " + problem);
    }
  }

  /** Table and fields side by side: without a window manager they lie on each other. */
  private static void arrange(String channel) {
    JFrame window = (JFrame) SwingUtilities.getWindowAncestor(table());
    int width = Toolkit.getDefaultToolkit().getScreenSize().width;
    int height = Toolkit.getDefaultToolkit().getScreenSize().height;
    window.setBounds(0, 0, width * 11 / 20, height);
    frame(channel).setBounds(width * 11 / 20, 0, width - width * 11 / 20, height);
  }

  private static JTable table() {
    for (Frame frame : Frame.getFrames()) {
      if (!frame.isShowing()) continue;
      JTable table = find(frame, JTable.class);
      if (table != null) return table;
    }
    return null;
  }

  private static JFrame frame(String title) {
    for (Frame frame : Frame.getFrames()) {
      if (frame.isShowing() && frame instanceof JFrame && title.equals(frame.getTitle())) {
        return (JFrame) frame;
      }
    }
    return null;
  }

  private static int rowOf(JTable table, String channel) {
    for (int row = 0; row < table.getRowCount(); ++row) {
      if (text(table, row, CHANNEL).equals(channel)) return row;
    }
    return -1;
  }

  private static String text(JTable table, int row, int column) {
    return String.valueOf(table.getValueAt(row, column)).trim();
  }

  private static <T> T find(java.awt.Container parent, Class<T> type) {
    for (java.awt.Component child : parent.getComponents()) {
      if (type.isInstance(child)) return type.cast(child);
      if (child instanceof java.awt.Container) {
        T found = find((java.awt.Container) child, type);
        if (found != null) return found;
      }
    }
    return null;
  }

  /** lcm-spy sorts its table on another thread than Swing's: between two rows an index may lead nowhere, so look again. */
  private static <T> T onSwing(Callable<T> call) throws Exception {
    for (int attempt = 1; ; ++attempt) {
      FutureTask<T> task = new FutureTask<>(call);
      SwingUtilities.invokeLater(task);
      try {
        return task.get(PATIENCE, TimeUnit.MILLISECONDS);
      } catch (java.util.concurrent.ExecutionException problem) {
        Throwable cause = problem.getCause();
        if (cause instanceof IndexOutOfBoundsException && attempt < 50) {
          Thread.sleep(20);
          continue;
        }
        throw cause instanceof Exception ? (Exception) cause : problem;
      }
    }
  }
}

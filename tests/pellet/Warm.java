import java.io.OutputStream;
import java.io.PrintStream;
import java.lang.management.ManagementFactory;
import java.util.Arrays;

/** Realises one document repeatedly in one JVM. Prints the median wall and CPU time in ms of the second half of the rounds. */
public class Warm {
    public static void main(String[] args) throws Exception {
        int rounds = Integer.parseInt(args[0]), warm = rounds / 2;
        String[] options = Arrays.copyOfRange(args, 1, args.length);
        PrintStream out = System.out;
        // Pellet prints its results to standard output, which is for the measurement only.
        System.setOut(new PrintStream(OutputStream.nullOutputStream()));
        var system = (com.sun.management.OperatingSystemMXBean) ManagementFactory.getOperatingSystemMXBean();
        double[] wall = new double[warm], cpu = new double[warm];
        for (int round = 0; round < rounds; round++) {
            long start = System.nanoTime(), before = system.getProcessCpuTime();
            pellet.PelletCmdApp reasoner = new pellet.PelletRealize();
            reasoner.parseArgs(options);
            reasoner.run();
            if (round >= rounds - warm) {
                wall[round - rounds + warm] = (System.nanoTime() - start) / 1e6;
                cpu[round - rounds + warm] = (system.getProcessCpuTime() - before) / 1e6;
            }
        }
        Arrays.sort(wall);
        Arrays.sort(cpu);
        out.println(wall[warm / 2] + " " + cpu[warm / 2]);
        System.exit(0);
    }
}
